/* The text of --print-config. */
#ifndef FARM_MASTER_PRINT_JOB_H
#define FARM_MASTER_PRINT_JOB_H

#include "common/settings.h"
#include "master/ini_source.h"

/*
 * An INI file that gives the same picture: the settings in effect, then the scene sections of the
 * document, with absolute paths. The caller frees it. A value that an INI file cannot hold (only an
 * argument can say it) is told as a warning.
 */
char *print_job(const struct settings *settings, const struct ini *ini);

#endif
