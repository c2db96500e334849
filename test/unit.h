/* cmocka, behind the headers that it needs and does not include. */
#ifndef FARM_TEST_UNIT_H
#define FARM_TEST_UNIT_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#endif
