/* The command line. */
#ifndef FARM_MASTER_OPTIONS_H
#define FARM_MASTER_OPTIONS_H

#include <stdbool.h>
#include <stddef.h>

enum action { ACTION_RENDER, ACTION_HELP, ACTION_VERSION, ACTION_CHECK, ACTION_PRINT_CONFIG };

struct options {
    enum action action;
    bool allow_outside;     /* files outside of CONFIG's folder */
    const char *config;     /* NULL for help and version */
    char *const *overrides; /* "section.key=value", in argv */
    size_t override_count;
};

/*
 * Parses the command line; false after user_error(). The options point into argv, whose arguments may be reordered.
 */
bool options_parse(int argc, char **argv, struct options *options);

#endif
