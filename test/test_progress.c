#include <fcntl.h>
#include <limits.h>
#include <math.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include "common/message.h"
#include "master/figure.h"
#include "master/progress.h"
#include "master/terminal.h"
#include "test/unit.h"

/* A terminal whose other end is read by the test. */
static struct {
    int descriptor;
    FILE *out;
    char text[4096];
} screen;

static void screen_resize(unsigned short columns)
{
    struct winsize size = {.ws_row = 24, .ws_col = columns};
    assert_int_equal(ioctl(screen.descriptor, TIOCSWINSZ, &size), 0);
}

static void screen_open(unsigned short columns)
{
    screen.descriptor = posix_openpt(O_RDWR | O_NOCTTY);
    if (screen.descriptor < 0 || grantpt(screen.descriptor) || unlockpt(screen.descriptor))
        skip(); /* no pseudo-terminals here */
    int other = open(ptsname(screen.descriptor), O_RDWR | O_NOCTTY);
    assert_true(other >= 0);
    struct termios mode;
    assert_int_equal(tcgetattr(other, &mode), 0);
    cfmakeraw(&mode);
    assert_int_equal(tcsetattr(other, TCSANOW, &mode), 0);
    screen.out = fdopen(other, "w");
    assert_non_null(screen.out);
    fcntl(screen.descriptor, F_SETFL, O_NONBLOCK);
    setenv("TERM", "xterm", 1);
    screen_resize(columns);
}

static void screen_close(void)
{
    fclose(screen.out);
    close(screen.descriptor);
}

/* What has been written since the last call. As a terminal passes text on in parts, a byte is written after the text,
 * and everything up to this byte is read. */
static const char *screen_read(void)
{
    static const char last = '\1';
    struct pollfd ready = {.fd = screen.descriptor, .events = POLLIN};
    size_t length = 0;
    assert_int_equal(write(fileno(screen.out), &last, 1), 1);
    while (length == 0 || screen.text[length - 1] != last) {
        assert_int_equal(poll(&ready, 1, 10000), 1);
        ssize_t bytes = read(screen.descriptor, screen.text + length, sizeof screen.text - length);
        assert_true(bytes > 0);
        length += (size_t)bytes;
    }
    screen.text[length - 1] = '\0';
    return screen.text;
}

static const struct progress_state half = {
    .share_done = 0.5, .tiles_done = 7, .tiles = 12, .rays = 25000000};

static struct progress progress;

static void begin(unsigned short columns, double now, double before)
{
    screen_open(columns);
    progress_start(&progress, screen.out, now, before);
}

static void end(void)
{
    progress_end(&progress);
    screen_close();
}

static void assert_shows(const struct progress_state *state, double now, const char *text)
{
    progress_update(&progress, state, now);
    assert_non_null(strstr(screen_read(), text));
}

static void test_counts(void **state)
{
    assert_string_equal(figure_count(0).text, "0");
    assert_string_equal(figure_count(999.4).text, "999");
    assert_string_equal(figure_count(999.6).text, "1.0k");
    assert_string_equal(figure_count(12345).text, "12.3k");
    assert_string_equal(figure_count(999949).text, "999.9k");
    assert_string_equal(figure_count(999951).text, "1.0M");
    assert_string_equal(figure_count(2.5e10).text, "25.0G");
    assert_string_equal(figure_count(1e300).text, "> 999T");
    assert_string_equal(figure_count((double)NAN).text, "> 999T");
}

/* As many digits as asked for, zeros included; a figure that is rounded up gets no digit more. */
static void test_digits(void **state)
{
    assert_string_equal(figure_digits(0.002997, 2).text, "0.0030");
    assert_string_equal(figure_digits(0.002997, 3).text, "0.00300");
    assert_string_equal(figure_digits(0.000996, 2).text, "0.0010");
    assert_string_equal(figure_digits(1, 2).text, "1.0");
    assert_string_equal(figure_digits(40.96, 3).text, "41.0");
    assert_string_equal(figure_digits(128, 2).text, "130");
    assert_string_equal(figure_digits(999999, 6).text, "999999");
    assert_string_equal(figure_digits(999999, 2).text, "1.0e+06");
    assert_string_equal(figure_digits(1e-7, 2).text, "0.00000010");
    assert_string_equal(figure_digits(9.9e-8, 2).text, "9.9e-08");
    assert_string_equal(figure_digits(1e-300, 6).text, "1.00000e-300");
    assert_string_equal(figure_digits(0, 2).text, "0");
    assert_string_equal(figure_digits(HUGE_VAL, 2).text, "inf");
}

/* A value that was typed looks as it did, also where %g would give it an exponent. */
static void test_round(void **state)
{
    assert_string_equal(figure_round(0.0005).text, "0.0005");
    assert_string_equal(figure_round(0.00005).text, "0.00005");
    assert_string_equal(figure_round(0.00125).text, "0.00125");
    assert_string_equal(figure_round(1.5e-7).text, "0.00000015");
    assert_string_equal(figure_round(1e-9).text, "1e-09");
    assert_string_equal(figure_round(1).text, "1");
    assert_string_equal(figure_round(100).text, "100");
    assert_string_equal(figure_round(2.5e10).text, "2.5e+10");
    assert_string_equal(figure_round(0).text, "0");
}

static void test_spans(void **state)
{
    assert_string_equal(figure_span(0).text, "0:00");
    assert_string_equal(figure_span(59.4).text, "0:59");
    assert_string_equal(figure_span(59.6).text, "1:00");
    assert_string_equal(figure_span(3723).text, "1:02:03");
    assert_string_equal(figure_span(999 * 3600.0).text, "999:00:00");
    assert_string_equal(figure_span(1e300).text, "> 999 h");
}

static void test_bar(void **state)
{
    begin(100, 100, 0);
    progress_update(&progress, &half, 110);
    assert_string_equal(screen_read(),
                        "\r 50 % [####################--------------------]   0:10 left"
                        "   7/12 tiles    2.5M rays/s   0:10\033[K");
    progress_end(&progress);
    assert_string_equal(screen_read(), "\r\033[K");
    screen_close();
}

/* Only the tiles of the current pass are shown. */
static void test_tiles_of_a_pass(void **state)
{
    struct progress_state later = half;
    later.tiles_before = 6;
    later.pass = 2;
    begin(100, 100, 0);
    assert_shows(&later, 110, "  pass 2 1/6 tiles  ");
    end();
}

/* At all widths the bar is one line, shorter than the window, with the percentage if there is room. */
static void test_bar_fits(void **state)
{
    begin(80, 0, 0);
    for (unsigned short columns = 1; columns < 300; columns++) {
        screen_resize(columns); /* as while it is running */
        progress_update(&progress, &half, 10.0 * columns);
        const char *text = screen_read(), *end = strstr(text, "\033[K");
        assert_int_equal(text[0], '\r');
        assert_non_null(end);
        assert_true(end - text - 1 < columns);
        assert_int_equal(strstr(text, " 50 %") != NULL, columns >= 6);
        assert_int_equal(strstr(text, " [") != NULL, columns >= 19);
        assert_int_equal(strstr(text, "left") != NULL, columns >= 31);
    }
    end();
}

static void test_bar_rate_of_redraws(void **state)
{
    begin(80, 0, 0);
    unsigned redraws = 0;
    for (int ms = 0; ms <= 1000; ms += 2) {
        progress_update(&progress, &half, ms / 1000.0);
        if (screen_read()[0]) redraws++;
    }
    assert_in_range(redraws, 8, 10);
    end();
}

/* Text that a message puts on the screen. */
static const char *screen_warn(void)
{
    int own = dup(STDERR_FILENO);
    assert_true(own >= 0 && dup2(fileno(screen.out), STDERR_FILENO) >= 0);
    user_warning(NULL, 0, "odd");
    assert_true(dup2(own, STDERR_FILENO) >= 0);
    close(own);
    return screen_read();
}

/* A message gets a line of its own, and the bar is redrawn below it. */
static void test_message_between(void **state)
{
    begin(80, 0, 0);
    assert_string_equal(screen_warn(), "farm: warning: odd\n");
    assert_shows(&half, 1, " 50 % [#");
    assert_string_equal(screen_warn(), "\r\033[Kfarm: warning: odd\n");
    assert_string_equal(screen_warn(), "farm: warning: odd\n");
    assert_shows(&half, 2, " 50 % [#");
    progress_end(&progress);
    assert_string_equal(screen_read(), "\r\033[K");
    assert_string_equal(screen_warn(), "farm: warning: odd\n");
    screen_close();
}

static void test_nothing_to_clean(void **state)
{
    begin(80, 0, 0);
    progress_update(&progress, &half, 0.05);
    progress_end(&progress);
    assert_string_equal(screen_read(), "");
    screen_close();
}

/* The time left is not shown after the first pixels alone, then changes without jumps. */
static void test_time_left(void **state)
{
    struct progress_state now = {.tiles = 10};
    begin(80, 0, 0);
    now.share_done = 0.01;
    assert_shows(&now, 1, "-:-- left");
    now.share_done = 0.5;
    assert_shows(&now, 10, "0:10 left");
    now.share_done = 0.9; /* a cheap part: by the plain rate it is 0:01 now */
    assert_shows(&now, 10.2, "0:09 left");
    assert_shows(&now, 40, "0:04 left");
    end();
}

/* A run of 1.6 s that begins with the expensive tiles, so that at first 5 s seem to be left. */
static void test_time_left_of_a_short_run(void **state)
{
    struct progress_state now = {.tiles = 10};
    begin(80, 0, 0);
    now.share_done = 0.02;
    assert_shows(&now, 0.1, "0:05 left");
    for (int tenths = 2; tenths <= 15; tenths++) {
        now.share_done = 0.02 + 0.98 * (tenths - 1) / 15;
        progress_update(&progress, &now, 0.101 * tenths); /* time to draw */
        const char *text = screen_read();
        if (tenths >= 12) assert_true(strstr(text, "0:00 left") || strstr(text, "0:01 left"));
    }
    end();
}

/* What an earlier run has finished does not count in this run's speed. */
static void test_time_left_resumed(void **state)
{
    struct progress_state now = {.share_done = 0.9, .share_before = 0.9, .tiles = 10};
    begin(80, 0, 0);
    assert_shows(&now, 1, "-:-- left");
    now.share_done = 0.95;
    assert_shows(&now, 30, "0:30 left");
    end();
}

/* What is shown of a single state, a second after the start. */
static const char *shown(struct progress_state now)
{
    now.tiles = 10;
    progress_start(&progress, screen.out, 0, 0);
    progress_update(&progress, &now, 1);
    const char *text = screen_read();
    progress_end(&progress);
    return text;
}

/* Nothing is shown beyond the end, of the work or of the time. */
static void test_beyond_the_end(void **state)
{
    screen_open(80);
    assert_non_null(strstr(shown((struct progress_state){.share_done = 1.5}), "\r100 % [#"));
    struct progress_state late = {.limit = 0.5, .ends = 0.5, .only_limit = true};
    assert_non_null(strstr(shown(late), "\r100 % [#"));
    assert_non_null(strstr(shown(late), " 0:00 left"));
    late.ends = 2; /* of a limit that has been extended */
    assert_non_null(strstr(shown(late), "\r  0 % [-"));
    /* A pass that begins when all is done */
    assert_non_null(
        strstr(shown((struct progress_state){.share_done = 1, .pass = 2}), "\r100 % [#"));
    screen_close();
}

/* A limit tells the time left before anything else does. */
static void test_limit_is_known_at_once(void **state)
{
    screen_open(80);
    const char *text = shown((struct progress_state){.limit = 20, .ends = 20});
    assert_non_null(strstr(text, " 0:19 left"));
    screen_close();
}

/* If the estimate of the total work grows, the share shown does not decrease, except for the next pass. */
static void test_never_backwards(void **state)
{
    struct progress_state now = half;
    begin(80, 0, 0);
    assert_shows(&now, 1, " 50 % [#");
    now.share_done = 0.4;
    assert_shows(&now, 2, " 50 % [#");
    now.pass = 1;
    assert_shows(&now, 3, " 40 % [#");
    end();
}

/* Work of earlier passes is not part of the current pass, but counts in the speed. */
static void test_share_of_a_pass(void **state)
{
    struct progress_state now = half;
    begin(80, 0, 0);
    now.pass = 1;
    assert_shows(&now, 10, " 50 % [#");
    now.pass = 2, now.share_done = 0.8; /* of more than before */
    progress_update(&progress, &now, 10.01);
    assert_string_equal(screen_read(), "");
    assert_shows(&now, 20, "  0 % [-");
    now.share_done = 0.75;
    assert_shows(&now, 21, "  0 % [-");
    now.share_done = 0.9;
    progress_update(&progress, &now, 40);
    const char *line = screen_read();
    assert_non_null(strstr(line, " 50 % [#"));
    assert_non_null(strstr(line, "0:04 left  pass 2"));
    now.share_done = 1;
    assert_shows(&now, 41, "100 % [#");
    end();
}

/* A time limit bounds the time left. If nothing else ends the run, it also determines the share shown. */
static void test_limit(void **state)
{
    struct progress_state now = half;
    now.pass = 3, now.limit = 10, now.ends = 9;
    begin(100, 0, 0);
    now.share_done = 0;
    progress_update(&progress, &now, 0);
    now.share_done = half.share_done;
    progress_update(&progress, &now, 6);
    const char *line = screen_read();
    assert_non_null(strstr(line, " 50 % [#"));
    assert_non_null(strstr(line, "0:03 left  pass 3  7/12 tiles"));
    now.only_limit = true;
    progress_update(&progress, &now, 7);
    line = screen_read();
    assert_non_null(strstr(line, " 80 % [#"));
    assert_non_null(strstr(line, "0:02 left"));
    now.pass = 4, now.share_done = 1;
    assert_shows(&now, 8, " 90 % [#");
    end();
}

static void test_strange_states(void **state)
{
    struct progress_state now = {0};
    begin(80, 0, 0);
    assert_shows(&now, 1, "  0 % [-");
    now = (struct progress_state){10,       20,         UINT32_MAX, UINT32_MAX, 0,
                                  UINT_MAX, UINT64_MAX, -1,         HUGE_VAL,   true};
    assert_shows(&now, 2, "100 % [#");
    end();
}

static void test_lines(void **state)
{
    FILE *out = tmpfile();
    assert_non_null(out);
    progress_start(&progress, out, 0, 0);
    for (int tenth = 0; tenth <= 110; tenth++)
        progress_update(&progress, &half, tenth / 10.0);
    struct progress_state pass = half;
    pass.pass = 2, pass.tiles_before = 6;
    progress_update(&progress, &pass, 12);
    pass.share_done = 0.75;
    progress_update(&progress, &pass, 20);
    pass.only_limit = true, pass.limit = pass.ends = 50;
    progress_update(&progress, &pass, 30);
    progress_end(&progress);
    char lines[400] = {0};
    rewind(out);
    assert_true(fread(lines, 1, sizeof lines - 1, out) > 0);
    assert_string_equal(
        lines, "farm: 50 %, 7 of 12 tiles, 5.0M rays/s, 0:05 elapsed, 0:05 left\n"
               "farm: 50 %, 7 of 12 tiles, 2.5M rays/s, 0:10 elapsed, 0:09 left\n"
               "farm: 50 % of pass 2, 1 of 6 tiles, 1.2M rays/s, 0:20 elapsed, 0:06 left\n"
               "farm: 60 %, pass 2, 1 of 6 tiles, 833.3k rays/s, 0:30 elapsed, 0:20 left\n");
    fclose(out);
}

/* The elapsed time is that of the run; rates and the time left are those of rendering. */
static void test_elapsed_before(void **state)
{
    FILE *out = tmpfile();
    assert_non_null(out);
    progress_start(&progress, out, 0, 12);
    progress_update(&progress, &half, 5);
    progress_end(&progress);
    char lines[200] = {0};
    rewind(out);
    assert_true(fread(lines, 1, sizeof lines - 1, out) > 0);
    assert_string_equal(lines, "farm: 50 %, 7 of 12 tiles, 5.0M rays/s, 0:17 elapsed, 0:05 left\n");
    fclose(out);
    begin(100, 0, 12);
    assert_shows(&half, 5, "5.0M rays/s   0:17");
    end();
}

static void test_dumb_terminal(void **state)
{
    screen_open(33);
    setenv("TERM", "dumb", 1);
    assert_int_equal(terminal_columns(screen.out), 33);
    progress_start(&progress, screen.out, 0, 0);
    progress_update(&progress, &half, 1);
    assert_string_equal(screen_read(), "");
    progress_update(&progress, &half, 6);
    const char *text = screen_read();
    assert_null(strchr(text, '\033'));
    assert_null(strchr(text, '\r'));
    assert_non_null(strchr(text, '\n'));
    end();
}

/* A pipe that was not made by a launcher. */
static void test_pipe_without_launcher(void **state)
{
    int ends[2];
    assert_int_equal(pipe(ends), 0);
    FILE *out = fdopen(ends[1], "w");
    unsetenv("PMI_RANK");
    unsetenv("PMI_FD");
    assert_int_equal(terminal_columns(out), 0);
    fclose(out);
    close(ends[0]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_counts),
        cmocka_unit_test(test_digits),
        cmocka_unit_test(test_round),
        cmocka_unit_test(test_spans),
        cmocka_unit_test(test_bar),
        cmocka_unit_test(test_tiles_of_a_pass),
        cmocka_unit_test(test_bar_fits),
        cmocka_unit_test(test_bar_rate_of_redraws),
        cmocka_unit_test(test_message_between),
        cmocka_unit_test(test_nothing_to_clean),
        cmocka_unit_test(test_time_left),
        cmocka_unit_test(test_time_left_of_a_short_run),
        cmocka_unit_test(test_time_left_resumed),
        cmocka_unit_test(test_beyond_the_end),
        cmocka_unit_test(test_limit_is_known_at_once),
        cmocka_unit_test(test_never_backwards),
        cmocka_unit_test(test_share_of_a_pass),
        cmocka_unit_test(test_limit),
        cmocka_unit_test(test_strange_states),
        cmocka_unit_test(test_lines),
        cmocka_unit_test(test_elapsed_before),
        cmocka_unit_test(test_dumb_terminal),
        cmocka_unit_test(test_pipe_without_launcher),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
