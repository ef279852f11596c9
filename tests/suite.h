/* What every suite begins with: cmocka, with what it wants to have been included before it, and
 * fresh structs of the interface. */
#ifndef PERP_TESTS_SUITE_H
#define PERP_TESTS_SUITE_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "fresh.h"

#endif
