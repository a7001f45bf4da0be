/* messages.h - what was wrong, where, and what to do about it; the tool's exit status.

   SPDX-License-Identifier: MIT */

#ifndef MESSAGES_H
#define MESSAGES_H

#include <stdio.h>

enum { DONE = 0, USAGE_ERROR = 1, FILE_ERROR = 2, RANGE_ERROR = 3 };

static const char *command_name = "envmap"; /* for messages */

/* Prints "envmap filter: where: what" and what to do about it; returns the exit status. */
static inline int fail(int status, const char *where, const char *what, const char *remedy) {
    fprintf(stderr, "envmap %s: %s: %s\n", command_name, where, what);
    if (remedy) fprintf(stderr, "  %s\n", remedy);
    return status;
}

static inline int status_of(envmap_result result) {
    switch (result) {
    case ENVMAP_OK: return DONE;
    case ENVMAP_ERROR_FILE:
    case ENVMAP_ERROR_FORMAT:
    case ENVMAP_ERROR_SHAPE:
    case ENVMAP_ERROR_TRUNCATED:
    case ENVMAP_ERROR_TRAILING: return FILE_ERROR;
    default: return RANGE_ERROR;
    }
}

static const char *remedy_for(envmap_result result) {
    switch (result) {
    case ENVMAP_ERROR_FILE: return "see that the path exists and may be read or written";
    case ENVMAP_ERROR_FORMAT:
        return "only float PFM files are read: 'PF' or 'Pf', size, scale, data";
    case ENVMAP_ERROR_SHAPE:
        return "name its parameterization: --mapping cube|paraboloid|sphere|latlong|angular";
    case ENVMAP_ERROR_TRUNCATED:
    case ENVMAP_ERROR_TRAILING: return "the file seems damaged; export or copy it again";
    case ENVMAP_ERROR_RADIANCE: return "`envmap info` counts NaN, infinite and negative samples";
    case ENVMAP_ERROR_LOBE: return "`envmap filter --help` lists the ranges of lobe parameters";
    case ENVMAP_ERROR_METHOD: return "--method reference filters with every lobe";
    case ENVMAP_ERROR_MEMORY:
    case ENVMAP_ERROR_LIMIT: return "ask for a smaller --size or fewer --slices";
    default: return NULL;
    }
}

/* 0 for OK; else says what happened at `where`. */
static inline int check(envmap_result result, const char *where) {
    if (!result) return DONE;
    return fail(status_of(result), where, envmap_result_text(result), remedy_for(result));
}

#endif /* MESSAGES_H */
