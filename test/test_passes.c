/* Passes of adaptive sampling under a time limit: how much the next one asks for, and the time that is reserved for the
 * end. */
#include <math.h>
#include <stdlib.h>

#include "test/master_fixture.h"
#include "test/unit.h"

/* The state of a run at the end of a pass. Two of its three processors have rendered all the time. */
struct standing {
    double elapsed, left; /* wall seconds */
    unsigned passes;      /* that are complete */
    double earlier;       /* seconds of processors' time, by an earlier run */
};

/* A pass comes in, whose pixels have errors as uneven as those of a picture. */
static void put_uneven_pass(struct farm *farm, double seconds)
{
    uint32_t pixels = farm->canvas.width * farm->canvas.height;
    struct tile all = {.w = farm->canvas.width, .h = farm->canvas.height, .step = 1, .pass = 1};
    uint32_t in = adaptive_pixels(farm->service.adaptive, &all);
    float *part = calloc(pixels, REFINED_FLOATS * sizeof *part);
    for (uint32_t i = 0; i < 3 * in; i++)
        part[3 * in + i] = (float)exp2(-0.07 * (i % 97));
    for (uint32_t i = 0; i < in; i++)
        part[6 * in + i] = part[3 * in + 3 * i];
    adaptive_put(farm->service.adaptive, &all, part, seconds);
    free(part);
}

/* Whether a pass is cut off once it is known that so much time is left, wall seconds. */
static bool is_cut_with(struct farm *farm, double left)
{
    farm->service.deadline = clock_wall() + left;
    farm->server.next_cut = 0; /* it is time to look again */
    follow_passes(&farm->server);
    return farm->server.is_cut;
}

/* The samples that the run then asks for, in seconds that as many took in the last pass; 0: none, as they would come
 * too late. *took: the wall seconds of this function, during which the run's clock goes on. */
static double asked_for(struct standing standing, double *took)
{
    struct farm *farm = farm_open(&small_tiles);
    struct view view = {.min_samples = 4, .max_samples = 4096};
    uint32_t pixels = farm->canvas.width * farm->canvas.height;
    struct tile all = {.w = farm->canvas.width, .h = farm->canvas.height, .step = 1};
    struct adaptive *adaptive = adaptive_create(&view, &farm->canvas, 1e-5);
    farm->service.adaptive = adaptive;
    double rendered = standing.earlier + 2 * standing.elapsed, samples = 4 * pixels;
    for (unsigned i = 1; i <= standing.passes; i++) {
        put_uneven_pass(farm, i == standing.passes ? rendered : 0);
        if (i == standing.passes) break;
        assert_true(adaptive_plan(adaptive, HUGE_VAL));
        samples = adaptive_work(adaptive, &all).samples;
    }
    while (other_goes_on(farm))
        ;
    farm->watch = (struct watch){.canvas = &farm->canvas, .adaptive = adaptive};
    assert_true(watch_start(&farm->watch, NULL));
    farm->service.processors = 3;
    farm->server.rendered_before = standing.earlier;
    farm->server.last_pass = false;
    double now = clock_wall();
    farm->service.deadline = now + standing.left;
    farm->server.start = now - standing.elapsed;
    follow_passes(&farm->server);
    *took = clock_wall() - now;
    assert_false(farm->server.last_pass);
    double seconds = adaptive_work(adaptive, &all).samples / samples * rendered;
    assert_true((seconds > 0) == !queue_complete(farm->service.queue));
    for (int look = 0; look < 5 && seconds > 0; look++) /* pass 0 alone is cut off */
        assert_false(is_cut_with(farm, 0.1));
    watch_free(&farm->watch);
    adaptive_destroy(adaptive);
    farm_close(farm);
    return seconds;
}

static void check_asked(struct standing standing, double least, double most)
{
    double seconds = 0, took = HUGE_VAL;
    /* Repeated where the test was kept waiting for more than half of the 0.01 s that are taken for work before anything
     * is known. */
    for (int attempt = 0; attempt < 100 && took > 0.005; attempt++)
        seconds = asked_for(standing, &took);
    if (!(seconds >= least && seconds <= most))
        fail_msg("%g s are asked for where %g are left", seconds, standing.left);
}

/* The pass after pass 0 gets half of the processors' time that is left, as far as they are busy; later ones get nine
 * tenths. Near the end a pass may ask for somewhat more than there is time for, but nothing is planned that would come
 * too late. Later samples take longer, but less so where a pixel gets more at a time. */
static void test_pass_fits_the_time(void **state)
{
    check_asked((struct standing){10, 4, 1, 0}, 1.5, 4);
    check_asked((struct standing){10, 20, 1, 0}, 9, 20);
    check_asked((struct standing){10, HUGE_VAL, 1, 0}, 100, HUGE_VAL);
    check_asked((struct standing){10, 4, 2, 0}, 5, 9);
    check_asked((struct standing){10, 0.7, 1, 0}, 0.7, 1.5);
    check_asked((struct standing){10, 0, 1, 0}, 0, 0);
    /* All three processors are expected to render: how busy those of an earlier run were does not matter. */
    check_asked((struct standing){0, 4, 1, 20}, 2.3, 6);
}

/* Of a time limit, so much is reserved as the end of the run takes, but no more than half. */
static void test_time_is_kept(void **state)
{
    struct farm *farm = farm_open(&small_tiles);
    struct service *service = &farm->service;
    service->images[0] = "picture.png";
    foresee_end(&farm->server);
    assert_true(farm->server.writing_s == 0); /* there is no limit */
    service->limit = 10;
    service->deadline = 100;
    foresee_end(&farm->server);
    assert_true(farm->server.writing_s > 0);
    farm->server.writing_s = 2;
    farm->served.last_plan_s = 0.5;
    farm->server.fill_s = 0.25;
    assert_true(rendering_ends(&farm->server) == 97.25);
    farm->server.writing_s = 5;
    assert_true(rendering_ends(&farm->server) == 95);
    farm_close(farm);
}

/* Pass 0 is cut off when it is going to be late at some looks in a row: a renderer that is late for a moment makes the
 * end look further away. What waits is withdrawn then, and how long all of it would have taken is kept. */
static void test_cut_when_late(void **state)
{
    struct farm *farm = farm_open(&small_tiles);
    struct view view = {.min_samples = 4, .max_samples = 64};
    struct queue *queue = farm->service.queue;
    farm->service.adaptive = adaptive_create(&view, &farm->canvas, 1e-5);
    farm->server.last_pass = false;
    farm->server.start -= 10;
    farm->server.rendered_before = -30; /* so that this run has rendered for 30 s */
    hand_out(&farm->server, 1);
    finish_all(&farm->server, 100);
    hand_out(&farm->server, 1);
    uint32_t tiles = queue_count(queue).tiles;
    double done = queue_count(queue).share_finished;
    for (int look = 0; look < 20; look++) {
        bool late = look % 3 > 0;
        assert_false(is_cut_with(farm, late ? 50 : 1e9));
        assert_int_equal(farm->server.late_looks, look % 3);
    }
    assert_false(is_cut_with(farm, 1e9));
    assert_false(is_cut_with(farm, 50) || is_cut_with(farm, 50));
    assert_int_equal(queue_count(queue).tiles, tiles);
    assert_true(is_cut_with(farm, 50));
    assert_true(queue_count(queue).tiles < tiles);
    assert_true(fabs(farm->server.cut_s * done - 30) < 1e-9);
    adaptive_destroy(farm->service.adaptive);
    farm_close(farm);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_pass_fits_the_time),
        cmocka_unit_test(test_time_is_kept),
        cmocka_unit_test(test_cut_when_late),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
