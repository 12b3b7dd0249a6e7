/* What bare calls of Embree take for the very rays of a render: the ceiling of its speed.
 *
 * Loaded in front of Embree (LD_PRELOAD; benches/ceiling.py does it), it stands between a program and its calls. With
 * OCTOLUX_CEILING=time it counts rays and reads the processor time of the calling thread now and then; with
 * OCTOLUX_CEILING=record it keeps every packet, and when the scene is released asks Embree all of them again, in the
 * same order, with the same lanes and flags and nothing in between, and takes the time of that. Prints a line of JSON.
 *
 * A repetition copies 64 packets at a time into a buffer that stays in the cache, untimed, because a renderer's rays
 * come out of its caches too; timed are the calls and the look at their answers. One thread. It knows the layout of
 * Embree 4.3 and later for packets of 1, 8 and 16: a packet of N has 48 N bytes of ray and 36 N of hit (1: 48).
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { BATCH = 64, LOOK = 256, ROUNDS = 5, RAY = 48, TFAR = 8, HIT_GEOM = 6 };

typedef void (*Packet)(const int *valid, void *scene, void *rays, void *args);
typedef void (*Single)(void *scene, void *rays, void *args);
typedef void (*Release)(void *scene);

struct Call { /* one packet as it was asked for */
    Packet packet;
    Single single;
    int lanes, hit;
    uint32_t flags, feature_mask;
    size_t at; /* of its rays, then its valid mask, in `store` */
};
struct Arguments { /* those that Octolux gives: no context, no callbacks */
    uint32_t flags, feature_mask;
    void *context, *filter, *callback;
};

static struct Call *calls;
static size_t count, room;
static char *store;
static size_t used, space;
static void *scene_of;
static uint64_t rays[2], asked, timed[2];
static double first = -1, last;

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int recording(void) {
    static int mode = -1;
    if (mode < 0) {
        const char *wanted = getenv("OCTOLUX_CEILING");
        mode = wanted && !strcmp(wanted, "record");
    }
    return mode;
}

static void *grown(void *old, size_t bytes) {
    void *memory = realloc(old, bytes);
    if (!memory) {
        fprintf(stderr, "ceiling: no memory for more rays; use a smaller film\n");
        exit(1);
    }
    return memory;
}

static int active(const int *valid, int lanes) {
    int n = 0;
    for (int i = 0; i < lanes; i++) n += valid ? valid[i] != 0 : 1;
    return n;
}

static void note(Packet packet, Single single, int lanes, int hit, const int *valid, void *scene, const void *ray,
                 const struct Arguments *args) {
    if (scene != scene_of) { /* a test of the program's own came before */
        scene_of = scene;
        count = used = 0;
        rays[0] = rays[1] = asked = 0;
        first = -1;
    }
    if (!recording() && asked++ % LOOK == 0) {
        last = now();
        if (first < 0) first = last;
        timed[0] = rays[0], timed[1] = rays[1];
    }
    rays[hit] += (uint64_t)active(valid, lanes);
    if (!recording() || !args) return; /* the test of the program's own has none */
    size_t bytes = (size_t)lanes * (RAY + 4);
    if (count == room) calls = grown(calls, sizeof *calls * (room = 2 * room + 4096));
    if (used + bytes > space) store = grown(store, space = 2 * space + (1 << 24));
    calls[count++] = (struct Call){packet, single, lanes, hit, args->flags, args->feature_mask, used};
    memcpy(store + used, ray, (size_t)lanes * RAY);
    if (valid) memcpy(store + used + lanes * RAY, valid, (size_t)lanes * 4);
    used += bytes;
}

/* Seconds of all calls of a round, those of intersect in [1], of occluded in [0]. */
static void replay(double seconds[2], double *sum) {
    static _Alignas(64) char hot[BATCH][16 * (RAY + 4)];
    _Alignas(64) char packet[16 * 84];
    for (size_t begin = 0, end; begin < count; begin = end) {
        for (end = begin; end < count && end < begin + BATCH && calls[end].hit == calls[begin].hit; end++)
            memcpy(hot[end - begin], store + calls[end].at, (size_t)calls[end].lanes * (RAY + 4));
        double t = now();
        for (size_t i = begin; i < end; i++) {
            const struct Call *c = &calls[i];
            struct Arguments args = {c->flags, c->feature_mask, 0, 0, 0};
            const char *from = hot[i - begin];
            size_t n = (size_t)c->lanes;
            memcpy(packet, from, n * RAY);
            if (c->hit) memset(packet + n * RAY + n * 4 * HIT_GEOM, 0xff, n * 4);
            if (c->single) c->single(scene_of, packet, &args);
            else c->packet((const int *)(from + n * RAY), scene_of, packet, &args);
            float tfar;
            memcpy(&tfar, packet + n * 4 * TFAR, 4);
            *sum += tfar < 0 ? 1 : 0;
        }
        seconds[calls[begin].hit] += now() - t;
    }
}

void rtcReleaseScene(void *scene) {
    static Release next;
    if (!next) next = (Release)dlsym(RTLD_NEXT, "rtcReleaseScene");
    if (scene == scene_of && rays[1] > 1000) {
        printf("{\"eye_rays\": %lu, \"shadow_rays\": %lu", rays[1], rays[0]);
        if (recording()) {
            double sum = 0;
            printf(", \"packets\": %zu, \"seconds\": [", count);
            for (int round = 0; round <= ROUNDS; round++) { /* the first one warms up */
                double seconds[2] = {0, 0};
                replay(seconds, &sum);
                if (round) printf("%s[%.6f, %.6f]", round > 1 ? ", " : "", seconds[1], seconds[0]);
            }
            printf("], \"occluded\": %.0f}\n", sum);
        } else {
            printf(", \"timed_rays\": %lu, \"seconds\": %.6f}\n", timed[0] + timed[1], last - first);
        }
        fflush(stdout);
    }
    if (scene == scene_of) scene_of = NULL; /* a later scene may get its address */
    next(scene);
}

#define PACKETS(NAME, LANES, HIT)                                                     \
    void NAME(const int *valid, void *scene, void *packet, void *args) {             \
        static Packet next;                                                           \
        if (!next) next = (Packet)dlsym(RTLD_NEXT, #NAME);                            \
        note(next, NULL, LANES, HIT, valid, scene, packet, args);                     \
        next(valid, scene, packet, args);                                             \
    }
#define SINGLES(NAME, HIT)                                                            \
    void NAME(void *scene, void *packet, void *args) {                                \
        static Single next;                                                           \
        if (!next) next = (Single)dlsym(RTLD_NEXT, #NAME);                            \
        note(NULL, next, 1, HIT, NULL, scene, packet, args);                          \
        next(scene, packet, args);                                                    \
    }
PACKETS(rtcIntersect8, 8, 1)
PACKETS(rtcIntersect16, 16, 1)
PACKETS(rtcOccluded8, 8, 0)
PACKETS(rtcOccluded16, 16, 0)
SINGLES(rtcIntersect1, 1)
SINGLES(rtcOccluded1, 0)
