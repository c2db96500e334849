#include <dirent.h>
#include <fcntl.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "common/message.h"
#include "master/hdr.h"
#include "master/image_file.h"
#include "master/output_file.h"
#include "master/png.h"
#include "test/files.h"
#include "test/random.h"
#include "test/unit.h"

#define STBI_ONLY_PNG
#define STBI_ONLY_HDR
#define STB_IMAGE_IMPLEMENTATION
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpragmas"
#pragma GCC diagnostic ignored "-Wunknown-warning-option"
#pragma GCC diagnostic ignored "-Wunused-but-set-variable"
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wsign-conversion"
#pragma GCC diagnostic ignored "-Wimplicit-int-conversion"
#pragma GCC diagnostic ignored "-Wdouble-promotion"
#pragma GCC diagnostic ignored "-Wcast-qual"
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wundef"
#include <stb/stb_image.h>
#pragma GCC diagnostic pop

/* Every test runs in an empty folder of its own. */
static char said[1000];

static int enter_folder(void **state)
{
    char *folder = copy_text("/tmp/farm-test-XXXXXX");
    if (!mkdtemp(folder) || chdir(folder)) return -1;
    message_capture(said, sizeof said);
    *state = folder;
    return 0;
}

static int leave_folder(void **state)
{
    message_capture(NULL, 0);
    char *command = format_text("rm -rf '%s'", (char *)*state);
    int status = chdir("/") || system(command);
    free(command);
    free(*state);
    return status;
}

static unsigned count_files(void)
{
    unsigned files = 0;
    DIR *folder = opendir(".");
    assert_non_null(folder);
    while (readdir(folder))
        files++;
    closedir(folder);
    return files - 2;
}

static void assert_file_is(const char *path, const char *expected)
{
    size_t bytes;
    char *text = read_bytes(path, &bytes);
    assert_string_equal(text, expected);
    free(text);
}

#define assert_said(part) assert_non_null(strstr(said, part))

/* Every refusal is one line. */
static void assert_one_line(void)
{
    assert_ptr_equal(strchr(said, '\n'), said + strlen(said) - 1);
}

/* The linker calls __wrap_ for png_encode(). */
void __real_png_encode(const struct canvas *canvas, struct thread_pool *pool, byte_sink *sink,
                       void *context);
void __wrap_png_encode(const struct canvas *canvas, struct thread_pool *pool, byte_sink *sink,
                       void *context);

/* What the encoder finds in the folder when it begins, which takes it a while, and in the end. */
static unsigned files_before, files_behind;

void __wrap_png_encode(const struct canvas *canvas, struct thread_pool *pool, byte_sink *sink,
                       void *context)
{
    files_before = count_files();
    __real_png_encode(canvas, pool, sink, context);
    files_behind = count_files();
}

static struct canvas sample_canvas(uint32_t width, uint32_t height)
{
    struct canvas canvas;
    canvas_init(&canvas, width, height);
    for (size_t i = 0; i < (size_t)width * height * 3; i++)
        canvas.rgb[i] = (float)((i * 2654435761u >> 8) % 1000) / 999;
    return canvas;
}

static void test_extensions(void **state)
{
    assert_true(image_extension_known("a.png"));
    assert_true(image_extension_known("x.y/a.b.PNG"));
    assert_true(image_extension_known("a.Hdr"));
    assert_true(image_extension_known("a.pfm"));
    assert_false(image_extension_known("a.jpg"));
    assert_false(image_extension_known("png"));
    assert_false(image_extension_known(""));
    assert_false(image_extension_known("a.png/b"));
    struct canvas canvas = sample_canvas(1, 1);
    assert_false(image_write("a.gif", &canvas, NULL));
    assert_said("a.gif: unknown kind of picture");
    assert_int_equal(count_files(), 0);
    canvas_free(&canvas);
}

static void test_png_values(void **state)
{
    const float values[] = {0,           1,      0.5f,  127.4f / 255, 127.6f / 255, 0.49f / 255,
                            0.51f / 255, -1,     2,     NAN,          HUGE_VALF,    -HUGE_VALF,
                            1e30f,       0.999f, 0.99f, 0.998f,       0.1f,         1e-30f};
    const unsigned char expected[] = {0, 255, 128, 127, 128, 0,   0 + 1, 0,  255,
                                      0, 255, 0,   255, 255, 252, 254,   26, 0};
    struct canvas canvas;
    canvas_init(&canvas, 3, 2);
    memcpy(canvas.rgb, values, sizeof values);
    assert_true(image_write("a.png", &canvas, NULL));
    int width, height, channels;
    unsigned char *bytes = stbi_load("a.png", &width, &height, &channels, 0);
    assert_non_null(bytes);
    assert_int_equal(width, 3);
    assert_int_equal(height, 2);
    assert_int_equal(channels, 3);
    assert_memory_equal(bytes, expected, sizeof expected);
    stbi_image_free(bytes);
    canvas_free(&canvas);
    assert_int_equal(count_files(), 1);
}

/* Alone and by three threads, the same file comes, which is what was written, and so does what is told of it. */
static void assert_written_together(uint32_t width, uint32_t height)
{
    struct canvas canvas = sample_canvas(width, height);
    struct thread_pool *pool = thread_pool_create(3);
    size_t sizes[2];
    assert_true(image_write("a.png", &canvas, NULL) && image_write("b.png", &canvas, pool));
    char *alone = read_bytes("a.png", &sizes[0]), *together = read_bytes("b.png", &sizes[1]);
    assert_int_equal(sizes[0], sizes[1]);
    assert_memory_equal(alone, together, sizes[0]);
    free(alone);
    free(together);
    int w, h, channels;
    unsigned char *bytes = stbi_load("b.png", &w, &h, &channels, 0);
    assert_non_null(bytes);
    assert_true(w == (int)width && h == (int)height && channels == 3);
    for (size_t i = 0; i < 3 * (size_t)width * height; i++)
        assert_int_equal(bytes[i], (int)floor((double)canvas.rgb[i] * 255 + 0.5));
    stbi_image_free(bytes);
    struct quantisation mine = image_quantisation("a.png", &canvas, NULL);
    struct quantisation ours = image_quantisation("a.png", &canvas, pool);
    assert_memory_equal(&mine, &ours, sizeof mine);
    thread_pool_destroy(pool);
    canvas_free(&canvas);
}

/* Of many bands, of rows that are longer than a band should be, and of next to nothing. */
static void test_png_by_a_pool(void **state)
{
    assert_written_together(1400, 900);
    assert_written_together(65535, 9);
    assert_written_together(1, 3000);
    assert_written_together(1, 1);
}

/* Every 8-bit value v / 255 survives. */
static void test_png_all_values(void **state)
{
    struct canvas canvas;
    canvas_init(&canvas, 256, 1);
    for (int i = 0; i < 256 * 3; i++)
        canvas.rgb[i] = (float)(i / 3) / 255;
    assert_true(image_write("a.png", &canvas, NULL));
    int width, height, channels;
    unsigned char *bytes = stbi_load("a.png", &width, &height, &channels, 0);
    assert_non_null(bytes);
    for (int i = 0; i < 256 * 3; i++)
        assert_int_equal(bytes[i], i / 3);
    stbi_image_free(bytes);
    canvas_free(&canvas);
}

/* Rows that follow from those above, by steps and by noise. */
static void test_png_rows(void **state)
{
    enum { WIDTH = 67, HEIGHT = 41 };
    struct canvas canvas;
    canvas_init(&canvas, WIDTH, HEIGHT);
    unsigned char expected[3 * WIDTH * HEIGHT];
    uint64_t random = 1;
    for (int i = 0; i < 3 * WIDTH * HEIGHT; i++) {
        int slope = i / (3 * WIDTH) * 5 + i % (3 * WIDTH) / 3;
        expected[i] = (unsigned char)(i % 2 ? slope & 255 : (int)random_below(&random, 256));
        canvas.rgb[i] = (float)expected[i] / 255;
    }
    assert_true(image_write("a.png", &canvas, NULL));
    int width, height, channels;
    unsigned char *bytes = stbi_load("a.png", &width, &height, &channels, 0);
    assert_non_null(bytes);
    assert_int_equal(width, WIDTH);
    assert_int_equal(height, HEIGHT);
    assert_memory_equal(bytes, expected, sizeof expected);
    stbi_image_free(bytes);
    canvas_free(&canvas);
}

static void test_hdr(void **state)
{
    struct canvas canvas = sample_canvas(40, 7);
    for (size_t i = 0; i < 30; i++)
        canvas.rgb[i] *= 1000;
    assert_true(image_write("a.hdr", &canvas, NULL));
    int width, height, channels;
    float *rgb = stbi_loadf("a.hdr", &width, &height, &channels, 3);
    assert_non_null(rgb);
    assert_int_equal(width, 40);
    assert_int_equal(height, 7);
    for (size_t i = 0; i < 40 * 7 * 3; i++) {
        const float *pixel = canvas.rgb + i / 3 * 3;
        float largest = fmaxf(pixel[0], fmaxf(pixel[1], pixel[2]));
        /* 8 bits of mantissa for the largest component, rounded. */
        assert_true(fabsf(rgb[i] - canvas.rgb[i]) <= largest / 256);
    }
    stbi_image_free(rgb);
    canvas_free(&canvas);
}

static void test_hdr_extremes(void **state)
{
    const float values[] = {-1, 0.5f, NAN, HUGE_VALF, 0, 0, 3e38f, 1, 1, 1e-40f, 0, 0};
    struct canvas canvas;
    canvas_init(&canvas, 4, 1);
    memcpy(canvas.rgb, values, sizeof values);
    assert_true(image_write("a.hdr", &canvas, NULL));
    int width, height, channels;
    float *rgb = stbi_loadf("a.hdr", &width, &height, &channels, 3);
    assert_non_null(rgb);
    assert_true(rgb[0] == 0 && rgb[1] == 0.5f && rgb[2] == 0);
    assert_true(rgb[3] > 1.6e38f && rgb[6] > 1.6e38f);
    assert_true(rgb[4] == 0 && rgb[9] == 0);
    stbi_image_free(rgb);
    canvas_free(&canvas);
}

static void test_pfm_is_exact(void **state)
{
    struct canvas canvas = sample_canvas(3, 2);
    canvas.rgb[0] = NAN;
    canvas.rgb[1] = -HUGE_VALF;
    canvas.rgb[2] = 1e-45f;
    assert_true(image_write("a.pfm", &canvas, NULL));
    size_t bytes;
    char *text = read_bytes("a.pfm", &bytes);
    const char *header =
        __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__ ? "PF\n3 2\n-1.0\n" : "PF\n3 2\n1.0\n";
    size_t start = strlen(header), row = 9 * sizeof(float);
    assert_int_equal(bytes, start + 2 * row);
    assert_memory_equal(text, header, start);
    assert_memory_equal(text + start, canvas.rgb + 9, row); /* the lower row comes first */
    assert_memory_equal(text + start + row, canvas.rgb, row);
    free(text);
    canvas_free(&canvas);
}

static void test_replaces_whole(void **state)
{
    write_text("a.json", "something much longer than what follows");
    assert_int_equal(chmod("a.json", 0640), 0);
    assert_true(text_write("output.report", "a.json", "{}\n"));
    assert_file_is("a.json", "{}\n");
    struct stat file;
    assert_int_equal(stat("a.json", &file), 0);
    assert_int_equal(file.st_mode & 0777, 0640);
    assert_int_equal(count_files(), 1);
}

static void test_permissions_of_new_file(void **state)
{
    mode_t old = umask(027);
    assert_true(text_write("output.report", "a.json", "x"));
    umask(old);
    struct stat file;
    assert_int_equal(stat("a.json", &file), 0);
    assert_int_equal(file.st_mode & 0777, 0640);
}

static void test_links_stay(void **state)
{
    assert_int_equal(mkdir("there", 0777), 0);
    write_text("there/real", "old");
    assert_int_equal(symlink("there/second", "first"), 0);
    assert_int_equal(symlink("real", "there/second"), 0); /* relative to its own folder */
    assert_true(output_writable("first", "output.report"));
    assert_true(text_write("output.report", "first", "new"));
    assert_file_is("there/real", "new");
    assert_int_equal(unlink("there/real"), 0); /* now it points at nothing */
    assert_true(output_writable("first", "output.report"));
    assert_true(text_write("output.report", "first", "again"));
    assert_file_is("there/real", "again");
    struct stat link;
    assert_int_equal(lstat("first", &link), 0);
    assert_true(S_ISLNK(link.st_mode));
    assert_int_equal(count_files(), 2);
}

static void test_links_in_circles(void **state)
{
    assert_int_equal(symlink("b", "a"), 0);
    assert_int_equal(symlink("a", "b"), 0);
    assert_false(output_writable("a", "output.report"));
    assert_one_line();
    assert_false(text_write("output.report", "a", "x"));
    assert_int_equal(count_files(), 2);
}

/* A full disk, as a limit on the size of files. */
static void test_failure_leaves_the_old_file(void **state)
{
    struct canvas canvas = sample_canvas(100, 100);
    write_text("a.pfm", "old");
    struct rlimit old, small;
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &old), 0);
    small = old;
    small.rlim_cur = 50000;
    void (*handler)(int) = signal(SIGXFSZ, SIG_IGN);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &small), 0);
    bool written = image_write("a.pfm", &canvas, NULL);
    setrlimit(RLIMIT_FSIZE, &old);
    signal(SIGXFSZ, handler);
    assert_false(written);
    assert_said("a.pfm: cannot write: File too large, choose another place with output.image=FILE");
    assert_one_line();
    assert_file_is("a.pfm", "old");
    assert_int_equal(count_files(), 1);
    canvas_free(&canvas);
}

static void test_full_device(void **state)
{
    struct canvas canvas = sample_canvas(30, 30);
    if (access("/dev/full", W_OK)) skip();
    assert_int_equal(symlink("/dev/full", "a.png"), 0);
    assert_int_equal(symlink("/dev/full", "a.pfm"), 0);
    assert_true(output_writable("a.png", "output.image"));
    assert_false(image_write("a.png", &canvas, NULL));
    assert_said("a.png: cannot write: No space left on device, free some space or choose another "
                "place with output.image=FILE");
    assert_one_line();
    assert_false(image_write("a.pfm", &canvas, NULL));
    assert_false(text_write("output.report", "/dev/full", "x"));
    assert_said("with output.report=FILE");
    assert_true(text_write("output.report", "/dev/null", "x"));
    canvas_free(&canvas);
}

static void test_fifo(void **state)
{
    assert_int_equal(mkfifo("pipe", 0600), 0);
    assert_true(output_writable("pipe", "output.report")); /* does not wait for a reader */
    int reader = open("pipe", O_RDONLY | O_NONBLOCK);
    assert_true(reader >= 0);
    assert_true(text_write("output.report", "pipe", "hello"));
    char text[10];
    assert_int_equal(read(reader, text, sizeof text), 5);
    assert_memory_equal(text, "hello", 5);
    close(reader);
    assert_int_equal(count_files(), 1);
}

/* Who reads may come later. */
static void test_fifo_without_reader(void **state)
{
    assert_int_equal(mkfifo("pipe", 0600), 0);
    pid_t child = fork();
    if (child == 0) {
        char text[10];
        usleep(100000);
        int reader = open("pipe", O_RDONLY);
        _exit(read(reader, text, sizeof text) == 5 && memcmp(text, "hello", 5) == 0 ? 0 : 1);
    }
    assert_true(text_write("output.report", "pipe", "hello"));
    assert_said("pipe is a pipe: waiting for somebody who reads from it");
    int status;
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_int_equal(status, 0);
}

static void assert_refused(const char *path, const char *why)
{
    assert_false(output_writable(path, "output.image"));
    assert_said(why);
    assert_said("output.image");
    assert_one_line();
    message_capture(said, sizeof said);
}

/* Writes to a path that names stdout, while that is a file. */
static void check_stdout(const char *path)
{
    fflush(stdout);
    int terminal = dup(STDOUT_FILENO);
    assert_non_null(freopen("out", "w", stdout));
    printf("before ");
    bool writable = output_writable(path, "output.report");
    bool written = text_write("output.report", path, "report ");
    printf("after");
    fflush(stdout);
    dup2(terminal, STDOUT_FILENO);
    close(terminal);
    assert_true(writable && written);
    assert_file_is("out", "before report after");
}

/* What the shell's "> file" and ">> file" expect. */
static void test_stdout(void **state)
{
    assert_int_equal(symlink("/dev/stdout", "link") + symlink("link", "again"), 0);
    assert_int_equal(symlink("/dev/fd", "folder") + symlink("folder/1", "inside"), 0);
    static const char *const paths[] = {"/dev/stdout",     "/dev/fd/1", "/dev//stdout",
                                        "/proc/self/fd/1", "link",      "again",
                                        "folder/1",        "inside"};
    for (size_t i = 0; i < sizeof paths / sizeof *paths; i++)
        check_stdout(paths[i]);
}

/* Other descriptors, such as the shell's "3>> file"; not one that MPI has open. */
static void test_descriptor(void **state)
{
    int ends[2], file = open("log", O_WRONLY | O_CREAT | O_APPEND, 0600);
    char *path = format_text("/dev/fd/%d", file);
    assert_int_equal(write(file, "before ", 7), 7);
    assert_true(output_writable(path, "output.report"));
    assert_true(text_write("output.report", path, "report"));
    assert_file_is("log", "before report");
    close(file);
    assert_refused(path, "cannot write: Bad file descriptor");
    free(path);
    assert_int_equal(socketpair(AF_UNIX, SOCK_STREAM, 0, ends), 0);
    path = format_text("/dev/fd/%d", ends[0]);
    assert_refused(path, "is a device, expected a file name");
    free(path);
    close(ends[0]);
    close(ends[1]);
    write_text("1", "old"); /* a number in another folder is a file's name */
    assert_true(text_write("output.report", "1", "new"));
    assert_file_is("1", "new");
}

static void test_writable_refusals(void **state)
{
    write_text("file", "");
    assert_refused("", "expected a file name");
    assert_refused(".", ".: is a folder, expected a file name");
    assert_refused("new/", "name of a folder");
    assert_refused("none/a.png", "none/a.png: the folder none/ does not exist");
    assert_refused("file/a.png", "Not a directory");
    assert_refused("/proc/a.png", "/proc/a.png: ");
    char *name = allocate_zeroed(301, 1);
    assert_refused(memset(name, 'x', 300), "File name too long");
    free(name);
    assert_int_equal(count_files(), 1);
}

static void test_writable_touches_nothing(void **state)
{
    write_text("a.png", "old");
    struct stat before, after;
    assert_int_equal(stat("a.png", &before), 0);
    assert_true(output_writable("a.png", "output.image"));
    assert_int_equal(stat("a.png", &after), 0);
    assert_int_equal(before.st_ino, after.st_ino);
    assert_file_is("a.png", "old");
    assert_true(output_writable("b.png", "output.image"));
    assert_int_equal(count_files(), 1);
    assert_string_equal(said, "");
}

/* A name of the greatest length leaves no room for a longer temporary one. */
static void test_long_name(void **state)
{
    char *name = allocate_zeroed(256, 1);
    memset(name, 'x', 255);
    assert_true(output_writable(name, "output.report"));
    assert_true(text_write("output.report", name, "x"));
    assert_file_is(name, "x");
    free(name);
}

static void test_read_only(void **state)
{
    if (geteuid() == 0) skip(); /* may write everywhere */
    write_text("a.png", "");
    assert_int_equal(chmod("a.png", 0444), 0);
    assert_refused("a.png", "Permission denied");
    assert_int_equal(mkdir("closed", 0555), 0);
    assert_refused("closed/a.png", "closed/a.png: the folder cannot be written to");
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, enter_folder, leave_folder)

/* What files lose, as it is read back from them. */
static void test_quantisation(void **state)
{
    struct canvas canvas;
    canvas_init(&canvas, 40, 3);
    for (int i = 0; i < 360; i++)
        canvas.rgb[i] = (float)i / 363 + 0.0003f;
    struct quantisation png = image_quantisation("a.png", &canvas, NULL);
    assert_true(png.clipped == 0 && png.clipped_rmse == 0);
    /* Half a step at most, and evenly spread below that. */
    assert_true(png.most <= 0.5 / 255 + 1e-7 && png.most > 0.45 / 255);
    assert_true(fabs(png.rmse * 255 * sqrt(12) - 1) < 0.1);
    struct quantisation pfm = image_quantisation("a.pfm", &canvas, NULL);
    assert_true(pfm.rmse == 0 && pfm.most == 0 && pfm.clipped == 0);
    assert_true(image_write("a.hdr", &canvas, NULL));
    int width, height, channels;
    float *back = stbi_loadf("a.hdr", &width, &height, &channels, 3);
    double most = 0;
    for (int i = 0; i < 360; i++)
        most = fmax(most, fabs((double)canvas.rgb[i] - (double)back[i]));
    stbi_image_free(back);
    struct quantisation hdr = image_quantisation("a.hdr", &canvas, NULL);
    assert_true(hdr.most == most && hdr.rmse < most && hdr.rmse > 0 && hdr.clipped == 0);
    canvas.rgb[3] = 2;
    canvas.rgb[5] = 5;
    canvas.rgb[7] = NAN;
    png = image_quantisation("a.png", &canvas, NULL);
    assert_true(png.clipped == 2 && png.most <= 0.5 / 255 + 1e-7);
    assert_true(fabs(png.clipped_rmse - sqrt((1 + 16) / 360.0)) < 1e-12);
    canvas_free(&canvas);
}

/* Nobody who is killed meanwhile leaves an empty file. */
static void test_no_file_while_encoding(void **state)
{
    struct canvas canvas = sample_canvas(7, 5);
    assert_true(image_write("a.png", &canvas, NULL));
    assert_int_equal(files_before, 0);
    assert_int_equal(files_behind, 1);
    assert_int_equal(count_files(), 1);
    canvas_free(&canvas);
}

static double seconds_of(const char *path, uint32_t width, uint32_t height, bool rendered)
{
    struct canvas canvas;
    canvas_init(&canvas, width, height);
    double seconds = image_seconds(path, &canvas, rendered, true, 1);
    /* Nothing of it is packed: without its rounding there is nothing to do. */
    if (strcmp(path, "a.pfm") == 0)
        assert_true(image_seconds(path, &canvas, rendered, false, 1) < seconds);
    canvas_free(&canvas);
    return seconds;
}

/* Of a small picture next to nothing, of a large one more. */
static void test_seconds(void **state)
{
    const char *const paths[] = {"a.png", "a.hdr", "a.pfm"};
    for (size_t i = 0; i < 3; i++) {
        for (int rendered = 0; rendered < 2; rendered++) {
            double small = seconds_of(paths[i], 64, 16, rendered);
            double large = seconds_of(paths[i], 1000, 700, rendered);
            assert_true(small > 0 && large > small && large < 3600);
        }
    }
}

/* What takes a while is told of before it is done. */
static void test_announced(void **state)
{
    const char *const paths[] = {"a.png", "a.hdr", "a.pfm"};
    struct canvas canvas;
    canvas_init(&canvas, 1000, 700);
    for (size_t i = 0; i < 3; i++) {
        char announced[200] = "", expected[40];
        message_capture(announced, sizeof announced);
        image_announce(paths[i], &canvas, 1, 3600);
        assert_string_equal(announced, "");
        image_announce(paths[i], &canvas, 1, 0);
        message_capture(NULL, 0);
        snprintf(expected, sizeof expected, "writing %s takes about ", paths[i]);
        assert_non_null(strstr(announced, expected));
    }
    canvas_free(&canvas);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(test_no_file_while_encoding),
        TEST(test_announced),
        TEST(test_extensions),
        TEST(test_png_values),
        TEST(test_quantisation),
        TEST(test_png_all_values),
        TEST(test_png_rows),
        TEST(test_png_by_a_pool),
        TEST(test_hdr),
        TEST(test_hdr_extremes),
        TEST(test_pfm_is_exact),
        TEST(test_replaces_whole),
        TEST(test_permissions_of_new_file),
        TEST(test_links_stay),
        TEST(test_links_in_circles),
        TEST(test_failure_leaves_the_old_file),
        TEST(test_full_device),
        TEST(test_fifo),
        TEST(test_fifo_without_reader),
        TEST(test_stdout),
        TEST(test_descriptor),
        TEST(test_writable_refusals),
        TEST(test_writable_touches_nothing),
        TEST(test_long_name),
        TEST(test_read_only),
        TEST(test_seconds),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
