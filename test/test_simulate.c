/* The simulated farm of bench/balance_sim.c, where its answer is known. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "bench/balance_sim.h"
#include "common/message.h"

enum { WIDTH = 64, HEIGHT = 64 };

#define PIXEL_S 1e-5

/* Every pixel costs the same, in tiles of any size. */
static struct tile_costs even_costs(void)
{
    struct tile_costs map = {.width = WIDTH, .height = HEIGHT, .samples = 1};
    for (unsigned level = 0; level < COST_LEVELS; level++) {
        size_t side = WIDTH >> level, tiles = side * side;
        map.levels[level] = allocate(tiles, sizeof(float));
        for (size_t i = 0; i < tiles; i++)
            map.levels[level][i] = (float)(PIXEL_S * (1 << 2 * level));
    }
    costs_derive(&map);
    return map;
}

static struct machine machine_of(uint32_t renderers)
{
    return (struct machine){
        .renderers = renderers, .node_cores = 1, .master_renders = true, .messages = {.nap_s = -1}};
}

static struct sim_outcome run(enum schedule schedule, const struct machine *machine)
{
    struct tile_costs map = even_costs();
    struct picture_costs costs = {.map = &map, .single = &map, .scale = 1, .samples = 1};
    bool asks = schedule == SCHEDULE_DYNAMIC || schedule == SCHEDULE_TILES;
    struct queue_config config = {.schedule = schedule,
                                  .width = WIDTH,
                                  .height = HEIGHT,
                                  .renderers = machine->renderers,
                                  .tile_edge = asks ? 4 : 0};
    struct queue *queue = queue_create(&config);
    struct sim_outcome outcome;
    simulate(machine, queue, &costs, &outcome);
    queue_destroy(queue);
    costs_free(&map);
    return outcome;
}

static void assert_near(double value, double expected, double share)
{
    if (fabs(value / expected - 1) <= share) return;
    print_error("%g instead of %g\n", value, expected);
    fail();
}

static const double all_s = WIDTH * HEIGHT * PIXEL_S;

/* One renderer takes as long as its work. A tile's own cost is taken for the cheapest pixel. */
static void test_serial(void **state)
{
    (void)state;
    struct machine machine = machine_of(1);
    for (int schedule = 0; schedule < SCHEDULES; schedule++) {
        struct sim_outcome outcome = run((enum schedule)schedule, &machine);
        assert_near(outcome.render_s, all_s, 0.02);
        assert_near(outcome.renderers[0].busy_s, outcome.render_s, 1e-9);
        assert_int_equal(outcome.renderers[0].pixels, WIDTH * HEIGHT);
        assert_int_equal(outcome.messages, 0);
        sim_outcome_free(&outcome);
    }
}

static void test_equal_shares(void **state)
{
    (void)state;
    struct machine machine = machine_of(4);
    for (int schedule = 0; schedule < SCHEDULES; schedule++) {
        struct sim_outcome outcome = run((enum schedule)schedule, &machine);
        assert_near(outcome.render_s, all_s / 4, 0.04);
        assert_true(outcome.messages > 0);
        sim_outcome_free(&outcome);
    }
}

/* Renderers that share cores take as long as the cores do. */
static void test_shared_cores(void **state)
{
    (void)state;
    struct machine machine = machine_of(8);
    machine.cores = 2;
    struct sim_outcome outcome = run(SCHEDULE_STRIPS, &machine);
    assert_near(outcome.render_s, all_s / 2, 0.02);
    assert_near(outcome.renderers[7].busy_s, all_s / 2, 0.02);
    sim_outcome_free(&outcome);
}

/* Strips wait for the slow one; who asks for tiles does not. */
static void test_speeds(void **state)
{
    (void)state;
    const double speeds[] = {1, 0.25, 1, 1};
    struct machine machine = machine_of(4);
    machine.speeds = speeds;
    struct sim_outcome outcome = run(SCHEDULE_STRIPS, &machine);
    assert_near(outcome.render_s, all_s, 0.02);
    sim_outcome_free(&outcome);
    outcome = run(SCHEDULE_TILES, &machine);
    assert_near(outcome.render_s, all_s / 3.25, 0.1);
    sim_outcome_free(&outcome);
}

/* A strip travels as one tile: to the renderer, and back to a master that is slow. */
static void test_messages(void **state)
{
    (void)state;
    struct machine machine = machine_of(2);
    struct sim_outcome plain = run(SCHEDULE_STRIPS, &machine);
    machine.messages.latency_s = 0.01;
    machine.messages.service_pixel_s = 1e-6;
    struct sim_outcome slow = run(SCHEDULE_STRIPS, &machine);
    double later = slow.render_s - plain.render_s, service = WIDTH * HEIGHT / 2 * 1e-6;
    assert_near(later, 2 * 0.01 + service, 0.01);
    assert_near(slow.master_s, service, 0.01);
    assert_true(slow.renderers[1].send_s >= 0.01);
    sim_outcome_free(&plain);
    sim_outcome_free(&slow);
}

/* Who naps sees a message at the end of the nap: 20, 40, 80 ... us, and what each is too long. */
static void test_naps(void **state)
{
    (void)state;
    struct machine machine = machine_of(2);
    struct sim_outcome spinning = run(SCHEDULE_TILES, &machine);
    machine.messages.nap_s = 1e-4;
    struct sim_outcome napping = run(SCHEDULE_TILES, &machine);
    assert_true(napping.render_s > spinning.render_s);
    assert_true(napping.render_s < spinning.render_s + 3e-3);
    sim_outcome_free(&spinning);
    sim_outcome_free(&napping);
}

/* A node of four cores behind one rank does the work of four renderers. */
static void test_nodes(void **state)
{
    (void)state;
    struct machine machine = machine_of(2);
    machine.node_cores = 4;
    machine.master_renders = false;
    struct sim_outcome outcome = run(SCHEDULE_DYNAMIC, &machine);
    assert_near(outcome.render_s, all_s / 8, 0.3);
    assert_int_equal(outcome.renderers[0].pixels + outcome.renderers[1].pixels, WIDTH * HEIGHT);
    sim_outcome_free(&outcome);
}

/* Twice the width and height and half of the samples: half of the cost of four times the pixels. */
static void test_scaled_costs(void **state)
{
    (void)state;
    struct tile_costs map = even_costs();
    struct picture_costs costs = {.map = &map, .single = &map, .scale = 2, .samples = 1, .top = 16};
    assert_int_equal(costs_width(&costs), 2 * WIDTH);
    assert_int_equal(costs_height(&costs), HEIGHT);
    assert_near(costs_total(&costs), 2 * all_s, 0.02);
    struct tile odd = {.x = 3, .y = 5, .w = 17, .h = 9, .step = 1};
    assert_near(costs_of(&costs, &odd), 17 * 9 * PIXEL_S, 0.05);
    struct tile cyclic = {.w = 2 * WIDTH, .h = 4, .phase = 1, .step = 3};
    assert_near(costs_of(&costs, &cyclic), tile_pixels(&cyclic) * PIXEL_S, 0.05);
    costs_free(&map);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_serial),       cmocka_unit_test(test_equal_shares),
        cmocka_unit_test(test_shared_cores), cmocka_unit_test(test_speeds),
        cmocka_unit_test(test_messages),     cmocka_unit_test(test_naps),
        cmocka_unit_test(test_nodes),        cmocka_unit_test(test_scaled_costs),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
