/* What the sections of `make bench-balance` share. */
#ifndef FARM_BENCH_BALANCE_H
#define FARM_BENCH_BALANCE_H

#include <stdint.h>
#include <stdio.h>

#include "bench/balance_costs.h"
#include "bench/balance_sim.h"

/* Folder of all results: bench/out/balance.md, bench/out/balance_*.csv and .svg. */
#define OUT_FOLDER "bench/out"

/* Folder of what is kept from one call to the next, so that sections can be run separately. */
#define KEPT_FOLDER "build/bench/balance.out"

/* The machine and the picture size of the paper. */
#define PAPER_PROCESSORS 44
#define PAPER_WIDTH      640u
#define PAPER_HEIGHT     480u

struct bench_scene {
    const char *name, *config;
    /* The paper's, of strips on 44 processors; it also tells which of the paper's pictures this is. */
    double paper_speedup;
};

#define SCENES 2
extern const struct bench_scene bench_scenes[SCENES];

/* ---- named numbers that are kept between calls: bench/balance_values.c ---- */

/* Sets a number; its name is formatted as by printf. */
void value_set(double value, const char *format, ...) __attribute__((format(printf, 2, 3)));
/* Gets a number; NAN when it was never set. */
double value_get(const char *format, ...) __attribute__((format(printf, 1, 2)));
void values_read(void);
void values_write(void);

/* ---- what is measured once: bench/balance_kept.c and others ---- */

/* The kept cost map of a scene; it is measured first if there is none that is newer than scene, meshes and
 * program. */
const struct tile_costs *kept_costs(const struct bench_scene *scene, uint32_t width,
                                    uint32_t height, uint32_t samples);
/* How often each tile is timed for a cost map: odd, so that there is a median. */
extern unsigned bench_rounds;
/* The message costs that the section "messages" has measured; of the master, when it serves without pause. */
struct message_costs kept_messages(void);
/* Measures the message costs at present, without what renderers spend besides tiles. */
struct message_costs measure_messages(void);
/* Measures how many times as long as without pause the master serves in real runs of PAPER_PROCESSORS ranks under
 * `dynamic`: the median of several. scene: its index in bench_scenes. */
double measure_serving(unsigned scene, uint32_t samples);
/* The factor that was measured for single samples, or for SERVING_SAMPLES from FEW_SAMPLES on, whose tiles are smaller
 * (queue_auto_edge()). It is measured first if there is none. */
#define FEW_SAMPLES     4u
#define SERVING_SAMPLES 16u
double kept_serving(const struct bench_scene *scene, uint32_t samples);
/* Measures the time slice: the seconds for which a process runs while another one waits for its processor. */
double measure_slice(void);
/* Measures which part of a core each of so many ranks but one uses while it waits for that one, in such a run
 * (farm_run()): the median of *looks samples. */
double measure_waiting(unsigned ranks, const char *config, const char *picture, const char *options,
                       unsigned *looks);

/* ---- sections of the report: bench/balance_sections.c ---- */

/* Whether each word of a list with commas is the name of a section. */
bool sections_known(const char *list);
/* Their names, each with what it is about. */
void sections_list(FILE *out);
/* Makes those on the list, NULL: all of them, and puts the report together. */
void sections_run(const char *list);

/* Each writes what it has found, behind its heading. */
void section_costs(FILE *out);
void section_messages(FILE *out);
void section_figures(FILE *out);
void section_static(FILE *out);
void section_real(FILE *out);
void section_model(FILE *out);
void section_adaptive(FILE *out);
void section_plan(FILE *out);
void section_marks(FILE *out);

/* Prints the speed-ups of a scene file for 2 to PAPER_PROCESSORS processors and all schedules. */
void compare_schedules(const char *config, uint32_t samples);

#endif
