/* cmocka, with what it wants to have been included before it. Every suite begins with it. */
#ifndef PERP_TESTS_SUITE_H
#define PERP_TESTS_SUITE_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#endif
