/* system.h - what the tool wants of POSIX, on Windows too. There a file that exists is replaced by
   a call of its own, links are not followed, and standard input is bytes only when asked to be.
   Include before envmap.h, and define _XOPEN_SOURCE 700 before all.

   SPDX-License-Identifier: MIT */

#ifndef SYSTEM_H
#define SYSTEM_H

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#ifdef _WIN32
#include <direct.h>
#include <io.h>

/* Of windows.h, whose other names are in the way. */
__declspec(dllimport) int __stdcall MoveFileExA(const char *from, const char *to,
                                                unsigned long how);
enum { SYSTEM_REPLACE = 1 }; /* MOVEFILE_REPLACE_EXISTING */

#define SYSTEM_SLASHES    "/\\"
#define lstat              stat
#define mkdir(path, mode)  _mkdir(path)
#define realpath(path, to) NULL
#define fchmod(file, mode) 0

/* rename() that may replace a file. */
static inline int system_rename(const char *from, const char *to) {
    if (MoveFileExA(from, to, SYSTEM_REPLACE)) return 0;
    errno = EACCES;
    return -1;
}

static inline void system_start(void) { _setmode(_fileno(stdin), _O_BINARY); }

#else

#define SYSTEM_SLASHES "/"

static inline int system_rename(const char *from, const char *to) { return rename(from, to); }

/* Where standard input, output or error is closed, its number must not go to a file that is opened
   later: it is a device that can only be read, so that printing to it fails and is noticed. A file
   that may not grow is an error to clean up after, not the end of the program. */
static inline void system_start(void) {
    int k;
    signal(SIGXFSZ, SIG_IGN);
    for (k = 0; k < 3; k++)
        if (fcntl(k, F_GETFD) == -1 && open("/dev/null", O_RDONLY) != k) return;
}

#endif
#endif /* SYSTEM_H */
