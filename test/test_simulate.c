/* Tests of the simulated farm of bench/balance_sim.c in cases whose result is known. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include "bench/balance_sim.h"
#include "bench/balance_trace.h"
#include "common/message.h"
#include "test/fatal.h"
#include "test/near.h"
#include "test/unit.h"

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
    uint32_t edge = HEIGHT; /* a share in one piece */
    if (schedule == SCHEDULE_DYNAMIC || schedule == SCHEDULE_TILES) edge = 4;
    if (schedule == SCHEDULE_CYCLIC_ROWS) edge = 0;
    struct queue_config config = {.schedule = schedule,
                                  .width = WIDTH,
                                  .height = HEIGHT,
                                  .renderers = machine->renderers,
                                  .tile_edge = edge};
    struct queue *queue = queue_create(&config);
    struct sim_outcome outcome;
    simulate(machine, queue, &costs, &outcome);
    queue_destroy(queue);
    costs_free(&map);
    return outcome;
}

static const double all_s = WIDTH * HEIGHT * PIXEL_S;

/* One renderer takes as long as its work. The fixed cost of a tile is that of the cheapest pixel. */
static void test_serial(void **state)
{
    struct machine machine = machine_of(1);
    for (int schedule = 0; schedule < SCHEDULES; schedule++) {
        struct sim_outcome outcome = run((enum schedule)schedule, &machine);
        assert_close(outcome.render_s, all_s, 0.02);
        assert_close(outcome.useful_s, outcome.render_s, 1e-9);
        assert_close(outcome.renderers[0].busy_s, outcome.render_s, 1e-9);
        assert_int_equal(outcome.renderers[0].pixels, WIDTH * HEIGHT);
        assert_int_equal(outcome.messages, 0);
        sim_outcome_free(&outcome);
    }
}

static void test_equal_shares(void **state)
{
    struct machine machine = machine_of(4);
    for (int schedule = 0; schedule < SCHEDULES; schedule++) {
        struct sim_outcome outcome = run((enum schedule)schedule, &machine);
        assert_close(outcome.render_s, all_s / 4, 0.04);
        assert_close(outcome.useful_s, all_s, 0.02);
        assert_close(sim_efficiency(&outcome, 4), all_s / 4 / outcome.render_s, 0.02);
        assert_true(outcome.messages > 0);
        sim_outcome_free(&outcome);
    }
}

/* Renderers that share cores take as long as the cores do. */
static void test_shared_cores(void **state)
{
    struct machine machine = machine_of(8);
    machine.cores = 2;
    machine.slice_s = 1e-5;
    struct sim_outcome outcome = run(SCHEDULE_STRIPS, &machine);
    assert_close(outcome.render_s, all_s / 2, 0.02);
    assert_close(outcome.renderers[7].busy_s, all_s / 2, 0.02);
    sim_outcome_free(&outcome);
    /* With time slices longer than the work, four renderers run one after the other on each core. */
    machine.slice_s = 1;
    outcome = run(SCHEDULE_STRIPS, &machine);
    assert_close(outcome.render_s, all_s / 2, 0.02);
    assert_close(outcome.renderers[0].busy_s, all_s / 8, 0.02);
    assert_close(outcome.renderers[7].busy_s, all_s / 8, 0.02);
    assert_close(outcome.renderers[7].finish_s, all_s / 2, 0.02);
    sim_outcome_free(&outcome);
}

/* A renderer that starts late finds less work. */
static void test_starts(void **state)
{
    const double starts[] = {0, all_s / 2};
    struct machine machine = machine_of(2);
    machine.starts = starts;
    struct sim_outcome outcome = run(SCHEDULE_TILES, &machine);
    assert_close(outcome.render_s, all_s * 3 / 4, 0.02);
    assert_true(outcome.renderers[0].pixels > 2 * outcome.renderers[1].pixels);
    sim_outcome_free(&outcome);
}

/* Polling for messages takes a part of one core, and the work beside each tile takes some time. */
static void test_beside_tiles(void **state)
{
    struct machine machine = machine_of(2);
    machine.cores = 1;
    machine.slice_s = 1e-4;
    machine.messages.looking_share = 0.1;
    struct sim_outcome outcome = run(SCHEDULE_TILES, &machine);
    assert_close(outcome.render_s, all_s / 0.9, 0.02);
    uint32_t tiles = outcome.tiles;
    sim_outcome_free(&outcome);
    machine.messages.looking_share = 0;
    machine.messages.tile_s = PIXEL_S;
    outcome = run(SCHEDULE_TILES, &machine);
    assert_close(outcome.render_s, all_s + tiles * PIXEL_S, 0.02);
    assert_close(outcome.useful_s, all_s, 0.02);
    sim_outcome_free(&outcome);
}

/* ---- the costs of one run ---- */

/* Writes a trace as the farm does, with one bar per line: two halves of the picture, of which the lower one was
 * rendered twice, and probes. */
static void write_trace(const char *path)
{
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    const struct {
        const char *kind;
        unsigned rank, x, y, w, h;
        double start, busy, cpu;
    } bars[] = {{"pre-pass", 0, 0, 3, 48, 1, 10, 50, 40},
                {"tile", 0, 0, 0, 64, 32, 100, 5000, 4000},
                {"wasted", 0, 0, 32, 64, 32, 5100, 70, 60},
                {"tile", 1, 0, 32, 64, 32, 200, 3000, 2000}};
    fprintf(file, "{\n\"traceEvents\": [\n{\"name\": \"waiting\", \"cat\": \"waiting\"},\n");
    for (size_t i = 0; i < sizeof bars / sizeof *bars; i++)
        fprintf(file,
                "{\"name\": \"%s %u,%u\", \"ph\": \"X\", \"tid\": %u, \"cat\": \"%s\", "
                "\"ts\": %g, \"dur\": %g, \"args\": {\"x\": %u, \"y\": %u, \"w\": %u, "
                "\"h\": %u, \"pixels\": 8, \"cpu_us\": %g, \"cpu_us_per_pixel\": 1}},\n",
                bars[i].kind, bars[i].x, bars[i].y, bars[i].rank, bars[i].kind, bars[i].start,
                bars[i].busy, bars[i].x, bars[i].y, bars[i].w, bars[i].h, bars[i].cpu);
    fprintf(file, "]}\n");
    fclose(file);
}

static void test_run_costs(void **state)
{
    char path[] = "/tmp/test_simulate_XXXXXX";
    int descriptor = mkstemp(path);
    assert_true(descriptor >= 0);
    close(descriptor);
    write_trace(path);
    struct trace trace;
    double starts[3];
    trace_read(&trace, path);
    remove(path);
    assert_int_equal(trace.count, 4);
    assert_close(trace_cpu(&trace), 6100e-6, 1e-9);
    assert_close(trace_work(&trace), 6040e-6, 1e-9);
    assert_close(trace_share(&trace, 0), 4100.0 / 5120, 1e-9);
    trace_starts(&trace, 3, starts);
    assert_close(starts[0], 10e-6, 1e-9);
    assert_close(starts[1], 200e-6, 1e-9);
    assert_true(starts[2] == 0);
    struct tile_costs map = even_costs();
    struct run_costs run;
    run_costs_init(&run, &trace, &map);
    struct picture_costs costs = {
        .map = &run.map, .single = &map, .scale = 1, .samples = 1, .run = &run};
    struct tile upper = {.w = 64, .h = 32, .step = 1}, lower = upper, part = upper, both = upper;
    lower.y = 32;
    part.x = 8, part.w = 16;
    both.y = 16;
    assert_close(costs_of(&costs, &upper), 4000e-6, 1e-9);
    assert_close(costs_of(&costs, &lower), 2000e-6, 1e-9);
    assert_close(costs_of(&costs, &part), 1000e-6, 0.02);
    assert_close(costs_of(&costs, &both), 3000e-6, 0.02);
    struct tile probes = {.y = 3, .w = 48, .h = 1, .step = 6, .pass = TILE_PROBE}, others = probes;
    others.y = 9;
    assert_close(costs_of(&costs, &probes), 40e-6, 1e-9);
    assert_close(costs_of(&costs, &others), 8 * PIXEL_S, 1e-6);
    run_costs_free(&run);
    costs_free(&map);
    trace_free(&trace);
}

/* With strips the run waits for the slow renderer; with tiles on request it does not. */
static void test_speeds(void **state)
{
    const double speeds[] = {1, 0.25, 1, 1};
    struct machine machine = machine_of(4);
    machine.speeds = speeds;
    struct sim_outcome outcome = run(SCHEDULE_STRIPS, &machine);
    assert_close(outcome.render_s, all_s, 0.02);
    sim_outcome_free(&outcome);
    outcome = run(SCHEDULE_TILES, &machine);
    assert_close(outcome.render_s, all_s / 3.25, 0.1);
    sim_outcome_free(&outcome);
}

/* A strip is sent as one tile: to the renderer, and back to a slow master. */
static void test_messages(void **state)
{
    struct machine machine = machine_of(2);
    struct sim_outcome plain = run(SCHEDULE_STRIPS, &machine);
    machine.messages.latency_s = 0.01;
    machine.messages.service_pixel_s = 1e-6;
    struct sim_outcome slow = run(SCHEDULE_STRIPS, &machine);
    double later = slow.render_s - plain.render_s, service = WIDTH * HEIGHT / 2 * 1e-6;
    assert_close(later, 2 * 0.01 + service, 0.01);
    assert_close(slow.master_s, service, 0.01);
    assert_true(slow.renderers[1].send_s >= 0.01);
    sim_outcome_free(&plain);
    sim_outcome_free(&slow);
}

/* On one machine results are passed in trays, at the cost of these, unless they are too long for a slot. */
static void test_trays(void **state)
{
    struct machine machine = machine_of(2);
    machine.rings = true;
    machine.messages.tray_s = 1e-5;
    struct sim_outcome trays = run(SCHEDULE_TILES, &machine);
    assert_true(trays.messages > 0);
    assert_close(trays.master_s, (double)trays.messages * 1e-5, 0.2);
    sim_outcome_free(&trays);
    machine = machine_of(1);
    machine.rings = true;
    machine.master_renders = false;
    machine.messages.fetch_s = 1e-5;
    struct sim_outcome whole = run(SCHEDULE_STRIPS, &machine);
    assert_close(whole.master_s, 1e-5, 0.01);
    sim_outcome_free(&whole);
}

/* The notice that a tile takes long arrives before its result, however long messages are under way: after the result,
 * the master would not know the tile any more. */
static void test_told_in_order(void **state)
{
    double speeds[8] = {1, 0.02, 1, 1, 1, 1, 1, 1};
    struct machine machine = machine_of(8);
    machine.rings = true;
    machine.speeds = speeds;
    machine.messages.byte_s = 1e-5;
    struct sim_outcome outcome = run(SCHEDULE_DYNAMIC, &machine);
    uint64_t pixels = 0;
    for (unsigned i = 0; i < 8; i++)
        pixels += outcome.renderers[i].pixels;
    assert_true(pixels >= WIDTH * HEIGHT);
    assert_true(outcome.render_s < all_s);
    sim_outcome_free(&outcome);
}

/* Tiles that several renderers have rendered, as a whole or in pieces, count once: a few renderers are slow, and learn
 * late what others have done in their place. */
static void test_in_vain(void **state)
{
    double speeds[8] = {1, 1, 1, 1, 1, 1, 1, 1}, work = 0;
    struct machine machine = machine_of(8);
    machine.speeds = speeds;
    machine.messages.latency_s = 2e-3;
    for (unsigned slow = 1; slow < 8; slow++) {
        speeds[slow] = 0.1;
        struct sim_outcome outcome = run(SCHEDULE_DYNAMIC, &machine);
        for (unsigned i = 0; i < 8; i++)
            work += outcome.renderers[i].busy_s * speeds[i];
        assert_true(outcome.useful_s > 0.995 * all_s && outcome.useful_s <= all_s);
        sim_outcome_free(&outcome);
    }
    assert_true(work > 1.08 * 7 * all_s);
}

/* A sleeping process sees a message at the end of its nap, of 5, 10, 20 ... us plus the lateness of each wake-up. */
static void test_naps(void **state)
{
    struct machine machine = machine_of(2);
    struct sim_outcome spinning = run(SCHEDULE_TILES, &machine);
    machine.messages.nap_s = 1e-4;
    struct sim_outcome napping = run(SCHEDULE_TILES, &machine);
    assert_true(napping.render_s > spinning.render_s);
    assert_true(napping.render_s < spinning.render_s + 3e-3);
    sim_outcome_free(&napping);
    /* A master that is woken loses no more time, although it sleeps longer if nobody wakes it. */
    machine.rings = true;
    struct sim_outcome woken = run(SCHEDULE_TILES, &machine);
    assert_true(woken.render_s > spinning.render_s);
    assert_true(woken.render_s < spinning.render_s + 3e-3);
    sim_outcome_free(&spinning);
    sim_outcome_free(&woken);
}

/* A node of four cores behind one rank does the work of four renderers. */
static void test_nodes(void **state)
{
    struct machine machine = machine_of(2);
    machine.node_cores = 4;
    machine.master_renders = false;
    struct sim_outcome outcome = run(SCHEDULE_DYNAMIC, &machine);
    assert_close(outcome.render_s, all_s / 8, 0.3);
    assert_int_equal(outcome.renderers[0].pixels + outcome.renderers[1].pixels, WIDTH * HEIGHT);
    sim_outcome_free(&outcome);
}

/* Twice the width and height with half of the samples: four times the pixels, at half of the cost each. */
static void test_scaled_costs(void **state)
{
    struct tile_costs map = even_costs();
    struct picture_costs costs = {.map = &map, .single = &map, .scale = 2, .samples = 1, .top = 16};
    assert_int_equal(costs_width(&costs), 2 * WIDTH);
    assert_int_equal(costs_height(&costs), HEIGHT);
    assert_close(costs_total(&costs), 2 * all_s, 0.02);
    struct tile odd = {.x = 3, .y = 5, .w = 17, .h = 9, .step = 1};
    assert_close(costs_of(&costs, &odd), 17 * 9 * PIXEL_S, 0.05);
    struct tile cyclic = {.w = 2 * WIDTH, .h = 4, .phase = 1, .step = 3};
    assert_close(costs_of(&costs, &cyclic), tile_pixels(&cyclic) * PIXEL_S, 0.05);
    costs_free(&map);
}

/* ---- shares whose pixels lie apart ---- */

static void test_apart(void **state)
{
    struct machine machine = machine_of(4);
    struct tile_costs map = even_costs();
    struct picture_costs costs = {.map = &map, .single = &map, .scale = 1, .samples = 1};
    struct queue_config config = {
        .schedule = SCHEDULE_CYCLIC, .width = WIDTH, .height = HEIGHT, .renderers = 4};
    double once = 0;
    for (uint32_t i = 0; i < 4; i++)
        once += costs_of_share(&costs, SCHEDULE_CYCLIC, 4, i);
    assert_close(once, all_s, 0.05);
    costs.apart_ratio = 1.5;
    assert_close(costs_of_share(&costs, SCHEDULE_CYCLIC, 4, 0), 1.5 * once / 4, 0.01);
    struct queue *queue = queue_create(&config);
    struct sim_outcome outcome;
    simulate(&machine, queue, &costs, &outcome);
    assert_close(outcome.render_s, 1.5 * once / 4, 0.01);
    queue_destroy(queue);
    sim_outcome_free(&outcome);
    costs_free(&map);
}

static void ask_for_unmeasured(void *map)
{
    costs_apart_ratio(map, SCHEDULE_CYCLIC, 3);
}

static void read_torn(void *path)
{
    struct tile_costs map;
    costs_read(&map, path);
}

/* The costs are measured for the requested numbers of renderers, and kept with the others. */
static void test_apart_is_kept(void **state)
{
    char folder[] = "/tmp/test_simulate_XXXXXX", said[128];
    assert_non_null(mkdtemp(folder));
    char *path = format_text("%s/costs", folder);
    struct tile_costs map, kept;
    costs_measure(&map, "config/hello.ini", WIDTH, HEIGHT, 1, 3, 1u << 2 | 1u << 5);
    costs_save(&map, path);
    assert_true(costs_read(&kept, path));
    for (unsigned i = 0; i < APART_SCHEDULES; i++)
        for (unsigned renderers = 0; renderers <= APART_MOST; renderers++) {
            assert_true((map.apart_ratio[i][renderers] > 0) == (renderers == 2 || renderers == 5));
            assert_true(kept.apart_ratio[i][renderers] == map.apart_ratio[i][renderers]);
        }
    assert_true(costs_apart_ratio(&kept, SCHEDULE_CYCLIC, 5) == map.apart_ratio[APART_CYCLIC][5]);
    assert_true(costs_apart_ratio(&kept, SCHEDULE_CYCLIC_ROWS, 2) ==
                map.apart_ratio[APART_CYCLIC_ROWS][2]);
    assert_true(costs_apart_ratio(&kept, SCHEDULE_CYCLIC, 1) == 1);
    assert_true(costs_apart_ratio(&kept, SCHEDULE_STRIPS, 3) == 1);
    assert_true(costs_apart_ratio(&kept, SCHEDULE_DYNAMIC, 3) == 1);
    assert_fatal(ask_for_unmeasured, &kept,
                 "farm: rank 0: shares of 3 renderers were not measured\n");
    assert_int_equal(truncate(path, 12 + 4 * (64 * 64 + 32 * 32 + 16 * 16 + 64 + 16 + 4 + 1)), 0);
    snprintf(said, sizeof said, "farm: rank 0: %s is damaged: remove it\n", path);
    assert_fatal(read_torn, path, said);
    costs_free(&map);
    costs_free(&kept);
    remove(path);
    rmdir(folder);
    free(path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_serial),        cmocka_unit_test(test_equal_shares),
        cmocka_unit_test(test_shared_cores),  cmocka_unit_test(test_speeds),
        cmocka_unit_test(test_messages),      cmocka_unit_test(test_trays),
        cmocka_unit_test(test_told_in_order), cmocka_unit_test(test_naps),
        cmocka_unit_test(test_nodes),         cmocka_unit_test(test_scaled_costs),
        cmocka_unit_test(test_starts),        cmocka_unit_test(test_beside_tiles),
        cmocka_unit_test(test_run_costs),     cmocka_unit_test(test_in_vain),
        cmocka_unit_test(test_apart),         cmocka_unit_test(test_apart_is_kept),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
