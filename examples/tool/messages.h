/* messages.h - what was wrong, where, and what to do about it; the tool's exit status.

   SPDX-License-Identifier: MIT */

#ifndef MESSAGES_H
#define MESSAGES_H

#include <errno.h>
#include <stdio.h>
#include <string.h>

enum { DONE = 0, USAGE_ERROR = 1, FILE_ERROR = 2, RANGE_ERROR = 3 };

static const char *command_name = ""; /* for messages; before there is one, "" */

/* Prints "envmap filter: where: what" and what to do about it; returns the exit status. */
static inline int fail(int status, const char *where, const char *what, const char *remedy) {
    fprintf(stderr, "envmap%s%s: %s: %s\n", *command_name ? " " : "", command_name, where, what);
    if (remedy) fprintf(stderr, "  %s\n", remedy);
    return status;
}

/* What the system says, in words of ours where they help. */
static inline const char *why_not(int error) {
    switch (error) {
    case ENOENT: return "does not exist";
    case EISDIR: return "is a folder, not a file";
    case ENOTDIR: return "a part of the path is a file, not a folder";
    case EACCES:
    case EPERM: return "you have no permission for it";
    case EROFS: return "the disk can only be read";
    case EFBIG: return "is too large for a file here";
    case ENOSPC: return "there is no space left";
    case EBADF: return "is closed";
    default: return error ? strerror(error) : "cannot be read or written";
    }
}

/* The same where a file could not be written: it need not exist, but its folder must. */
static inline const char *why_not_written(int error) {
    return error == ENOENT ? "its folder does not exist" : why_not(error);
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

static inline const char *remedy_for(envmap_result result) {
    switch (result) {
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
    if (result == ENVMAP_ERROR_FILE) return fail(FILE_ERROR, where, why_not(errno), NULL);
    return fail(status_of(result), where, envmap_result_text(result), remedy_for(result));
}

#endif /* MESSAGES_H */
