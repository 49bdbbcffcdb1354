/* What a file system may do to a program: gcc -shared -fPIC -O2 -o fault.so fault.c -ldl, and LD_PRELOAD it.

   After arm() each operation that changes a file below `folder`, or locks one, is counted and written to the log as
   "kind<TAB>path<TAB>new path". The operation number `at` kills the process (number 0) or fails with that errno, and with
   `forever` so does every later one. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#define LONGEST 4096
static char folder[LONGEST];
static long at, count;
static int armed, number, forever, told = -1;

#define NEXT(name)                                                                                                     \
    static __typeof__(name) *next;                                                                                     \
    if (!next) next = (__typeof__(name) *)dlsym(RTLD_NEXT, #name)

static ssize_t plain_write(int fd, const void *data, size_t size) {
    NEXT(write);
    return next(fd, data, size);
}

void arm(const char *below, long point, int error, int stay, const char *log) {
    strncpy(folder, below, LONGEST - 1);
    at = point, number = error, forever = stay, count = 0;
    told = *log ? open(log, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644) : -1;
    armed = 1;
}

static const char *of_descriptor(int fd, char *found) {
    char link[64];
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    ssize_t size = readlink(link, found, LONGEST - 1);
    if (size < 0) return "";
    found[size] = 0;
    return found;
}

static const char *whole(int fd, const char *path, char *found) {
    if (!path) return "";
    if (path[0] == '/') return path;
    char here[LONGEST];
    if (fd == AT_FDCWD) {
        if (!getcwd(here, sizeof here)) return path;
    } else {
        of_descriptor(fd, here);
    }
    snprintf(found, 2 * LONGEST, "%s/%s", here, path);
    return found;
}

/* Whether this operation is to fail. */
static int fails(const char *kind, const char *path, const char *other) {
    if (!armed || strncmp(path, folder, strlen(folder))) return 0;
    count++;
    if (told >= 0) {
        char line[5 * LONGEST];
        int size = snprintf(line, sizeof line, "%s\t%s\t%s\n", kind, path, other);
        if (plain_write(told, line, size) < 0) abort();
    }
    if (count == at || (forever && at && count > at)) {
        if (!number) {
            kill(getpid(), SIGKILL);
            pause();
        }
        errno = number;
        return 1;
    }
    return 0;
}

#define ON_DESCRIPTOR(kind)                                                                                            \
    char path[LONGEST];                                                                                                \
    if (armed && fd > 2 && fd != told && fails(kind, of_descriptor(fd, path), "")) return -1
#define ON_PATH(kind, fd, name)                                                                                        \
    char path[2 * LONGEST];                                                                                            \
    if (armed && fails(kind, whole(fd, name, path), "")) return -1

ssize_t write(int fd, const void *data, size_t size) { ON_DESCRIPTOR("write"); return plain_write(fd, data, size); }
ssize_t pwrite64(int fd, const void *data, size_t size, off64_t place) {
    NEXT(pwrite64);
    ON_DESCRIPTOR("write");
    return next(fd, data, size, place);
}
int ftruncate64(int fd, off64_t size) { NEXT(ftruncate64); ON_DESCRIPTOR("write"); return next(fd, size); }
int fsync(int fd) { NEXT(fsync); ON_DESCRIPTOR("fsync"); return next(fd); }
int fdatasync(int fd) { NEXT(fdatasync); ON_DESCRIPTOR("fsync"); return next(fd); }
int flock(int fd, int how) { NEXT(flock); ON_DESCRIPTOR("lock"); return next(fd, how); }
int unlink(const char *name) { NEXT(unlink); ON_PATH("remove", AT_FDCWD, name); return next(name); }
int unlinkat(int fd, const char *name, int how) { NEXT(unlinkat); ON_PATH("remove", fd, name); return next(fd, name, how); }
int rmdir(const char *name) { NEXT(rmdir); ON_PATH("remove", AT_FDCWD, name); return next(name); }
int mkdir(const char *name, mode_t mode) { NEXT(mkdir); ON_PATH("mkdir", AT_FDCWD, name); return next(name, mode); }
int mkdirat(int fd, const char *name, mode_t mode) { NEXT(mkdirat); ON_PATH("mkdir", fd, name); return next(fd, name, mode); }
int chmod(const char *name, mode_t mode) { NEXT(chmod); ON_PATH("chmod", AT_FDCWD, name); return next(name, mode); }

static int renaming(int a, const char *from, int b, const char *to) {
    char old[2 * LONGEST], new[2 * LONGEST];
    return armed && fails("rename", whole(a, from, old), whole(b, to, new));
}
int rename(const char *from, const char *to) {
    NEXT(rename);
    return renaming(AT_FDCWD, from, AT_FDCWD, to) ? -1 : next(from, to);
}
int renameat(int a, const char *from, int b, const char *to) {
    NEXT(renameat);
    return renaming(a, from, b, to) ? -1 : next(a, from, b, to);
}

#define MODE                                                                                                           \
    mode_t mode = 0;                                                                                                   \
    if (how & (O_CREAT | __O_TMPFILE)) {                                                                               \
        va_list rest;                                                                                                  \
        va_start(rest, how);                                                                                           \
        mode = va_arg(rest, mode_t);                                                                                   \
        va_end(rest);                                                                                                  \
    }
#define FOR_WRITING (how & (O_WRONLY | O_RDWR))
#define OPEN(name)                                                                                                     \
    int name(const char *file, int how, ...) {                                                                         \
        NEXT(name);                                                                                                    \
        MODE;                                                                                                          \
        char path[2 * LONGEST];                                                                                        \
        if (armed && FOR_WRITING && fails("open", whole(AT_FDCWD, file, path), "")) return -1;                         \
        return next(file, how, mode);                                                                                  \
    }
#define OPENAT(name)                                                                                                   \
    int name(int fd, const char *file, int how, ...) {                                                                 \
        NEXT(name);                                                                                                    \
        MODE;                                                                                                          \
        char path[2 * LONGEST];                                                                                        \
        if (armed && FOR_WRITING && fails("open", whole(fd, file, path), "")) return -1;                               \
        return next(fd, file, how, mode);                                                                              \
    }
OPEN(open)
OPEN(open64)
OPENAT(openat)
OPENAT(openat64)
