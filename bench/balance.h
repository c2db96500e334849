/* make bench-balance: what its sections share. */
#ifndef FARM_BENCH_BALANCE_H
#define FARM_BENCH_BALANCE_H

#include <stdint.h>
#include <stdio.h>

#include "bench/balance_costs.h"
#include "bench/balance_sim.h"

/* Where everything is put: bench/out/balance.md, bench/out/balance_*.csv and .svg. */
#define OUT_FOLDER "bench/out"

/* What is kept from one call to the next, so that sections can be run apart. */
#define KEPT_FOLDER "build/bench/balance.out"

/* The paper's machine and its pictures. */
#define PAPER_PROCESSORS 44
#define PAPER_WIDTH      640u
#define PAPER_HEIGHT     480u

struct bench_scene {
    const char *name, *config;
    double paper_speedup; /* of the strips on 44 processors; also which of its pictures it is */
};

#define SCENES 2
extern const struct bench_scene bench_scenes[SCENES];

/* ---- numbers that are kept: bench/balance_values.c ---- */

/* Name and value; a name is made as by printf. */
void value_set(double value, const char *format, ...) __attribute__((format(printf, 2, 3)));
/* NAN when it was never set. */
double value_get(const char *format, ...) __attribute__((format(printf, 1, 2)));
void values_read(void);
void values_write(void);

/* ---- files: bench/balance_files.c ---- */

/* For writing, in OUT_FOLDER; ends the program when that fails. */
FILE *open_out(const char *name);
/* A section of the report, with its heading and the time it was made: once it is whole, close_section() puts it in
 * the place of the earlier one, and join_report() puts all of them together. */
FILE *open_section(const char *section, const char *heading);
void close_section(FILE *file, const char *section);
void join_report(void);
/* Runs gnuplot over a script that was written to OUT_FOLDER. */
void plot(const char *script);
/* The kept cost map of a scene; measures it first when there is none that is newer than
 * scene, meshes and program. */
const struct tile_costs *kept_costs(const struct bench_scene *scene, uint32_t width,
                                    uint32_t height, uint32_t samples);
/* How often every tile is timed then: odd, so that there is a median. */
extern unsigned bench_rounds;
/* As they were measured by the section "messages". */
struct message_costs kept_messages(void);
/* As they are now, without what renderers spend beside tiles. */
struct message_costs measure_messages(void);
/* Seconds for which a process goes on while another one waits for its processor. */
double measure_slice(void);
/* What each of so many ranks but one uses of a core while it waits for that one, by such a run
 * (farm_run()), in the median of so many looks. */
double measure_waiting(unsigned ranks, const char *config, const char *picture, const char *options,
                       unsigned *looks);

/* ---- sections ---- */

void section_costs(void);
void section_messages(void);
void section_figures(void);
void section_static(void);
void section_real(void);
void section_model(void);
void section_plan(void);
void section_marks(void);

/* Prints the speed-ups of a scene file, by 2 to PAPER_PROCESSORS processors and all schedules. */
void compare_schedules(const char *config, uint32_t samples);

#endif
