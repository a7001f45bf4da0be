/* SPDX-License-Identifier: MIT
   The bodies of envmap.h with the tests' memory, once for all tests that use its public names. */
#define ENVMAP_IMPLEMENTATION
#include "oracle.h"
