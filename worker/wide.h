/*
 * What quads, lanes and floats (worker/quad.h, lanes.h, floats.h) have in common: a row of numbers is one
 * register, `v`, or an array, `at`, with loops over it.
 */
#ifndef FARM_WORKER_WIDE_H
#define FARM_WORKER_WIDE_H

#include <stdint.h>

/* The doubles in a row of lanes, and the floats in one of floats: rays in a packet, children of a node, triangles that
 * are tested together. */
#define LANES 8

/* A set of lanes: a bit for each number of a row, the lowest for the first. */
typedef uint32_t lane_set;

#define REGISTER_2(type, name, operation)                                                          \
    static inline struct type name(struct type a, struct type b)                                   \
    {                                                                                              \
        return (struct type){operation(a.v, b.v)};                                                 \
    }

#define ROW_LENGTH(row) (sizeof(row).at / sizeof(row).at[0])

#define LOOP_1(type, name, function)                                                               \
    static inline struct type name(struct type a)                                                  \
    {                                                                                              \
        for (unsigned i = 0; i < ROW_LENGTH(a); i++)                                               \
            a.at[i] = function(a.at[i]);                                                           \
        return a;                                                                                  \
    }

#define LOOP_2(type, name, expression)                                                             \
    static inline struct type name(struct type a, struct type b)                                   \
    {                                                                                              \
        for (unsigned i = 0; i < ROW_LENGTH(a); i++)                                               \
            a.at[i] = expression;                                                                  \
        return a;                                                                                  \
    }

#define LOOP_COMPARE(type, name, comparison)                                                       \
    static inline lane_set name(struct type a, struct type b)                                      \
    {                                                                                              \
        lane_set set = 0;                                                                          \
        for (unsigned i = 0; i < ROW_LENGTH(a); i++)                                               \
            set |= (lane_set)(a.at[i] comparison b.at[i]) << i;                                    \
        return set;                                                                                \
    }

#endif
