#include "common/processor.h"

#include <stdatomic.h>
#include <stddef.h>
#ifdef __x86_64__
#include <cpuid.h>
#endif

#include "common/message.h"

const char *const processor_level_names[PROCESSOR_LEVELS + 1] = {"auto", "portable", "avx2",
                                                                 "avx512", NULL};

#ifdef __x86_64__

/*
 * LZCNT has no name for Clang's __builtin_cpu_supports(). The result is cached, because under a hypervisor
 * CPUID takes tens of microseconds and the level is resolved for every tile and probe.
 */
static bool has_lzcnt(void)
{
    enum { UNKNOWN, ABSENT, PRESENT };
    static atomic_int known = UNKNOWN;
    if (known == UNKNOWN) {
        unsigned a, b, c = 0, d;
        known = __get_cpuid(0x80000001, &a, &b, &c, &d) && (c & bit_ABM) ? PRESENT : ABSENT;
    }
    return known == PRESENT;
}

/* All extensions that the Makefile lets the compiler use for this level; likewise below. */
static bool has_avx2(void)
{
    return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
           __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2") &&
           __builtin_cpu_supports("popcnt") && has_lzcnt();
}

static bool has_avx512(void)
{
    return has_avx2() && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
           __builtin_cpu_supports("avx512dq");
}

#else

static bool has_avx2(void)
{
    return false;
}

static bool has_avx512(void)
{
    return false;
}

#endif

#ifdef KERNEL_AVX512
#define AVX512_BUILT true
#else
#define AVX512_BUILT false
#endif

bool processor_has(enum processor_level level)
{
    if (level == PROCESSOR_AVX512) return AVX512_BUILT && has_avx512();
    return level == PROCESSOR_AVX2 ? has_avx2() : true;
}

const char *processor_lacks(enum processor_level level)
{
    return level == PROCESSOR_AVX512 && has_avx512() ? "not in this build"
                                                     : "not for this processor";
}

char *processor_choices(bool (*has)(enum processor_level level))
{
    const char *names[PROCESSOR_LEVELS + 1] = {processor_level_names[PROCESSOR_AUTO]};
    size_t count = 1;
    for (int level = PROCESSOR_AUTO + 1; level < PROCESSOR_LEVELS; level++)
        if (has((enum processor_level)level)) names[count++] = processor_level_names[level];
    return join_names(names);
}

enum processor_level processor_resolve(enum processor_level level)
{
    if (level != PROCESSOR_AUTO) return level;
    if (processor_has(PROCESSOR_AVX512)) return PROCESSOR_AVX512;
    return has_avx2() ? PROCESSOR_AVX2 : PROCESSOR_PORTABLE;
}
