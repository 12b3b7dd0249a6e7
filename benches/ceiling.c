/* What bare calls of Embree take for the very rays of a render, while it renders: the ceiling of its speed.
 *
 * Loaded in front of Embree (LD_PRELOAD; benches/ceiling.py does it), it stands between a program and its calls, and takes turns:
 *
 *   settle   a few calls pass, until the program has its caches back;
 *   render   calls pass; the processor time from the first to the last is the renderer's;
 *   settle   again;
 *   replay   packets that were kept DELAY turns ago are asked again, in their order, with the same lanes and flags and nothing
 *            in between, and the time of that is taken. Older ones, since those just asked would find their part of the scene
 *            in the cache;
 *   keep     calls pass, and every packet is kept.
 *
 * A turn takes some milliseconds, so that what else the machine does slows both sides alike. With OCTOLUX_CEILING=swap, render and
 * keep change places: of two renders, one each way, every ray is once rendered and once replayed, whatever rays cost from one part
 * of the picture to the next. Prints a line of JSON when the scene is released: for each turn [seconds of rendering,
 * eye rays kept, shadow rays kept, seconds of their replay: of the eye rays, of the shadow rays].
 *
 * A replay copies 64 packets at a time into a buffer that stays in the cache, untimed, because a renderer's rays come out of its
 * caches too; timed are the calls and the look at their answers, less what reading the clock takes. One thread. It knows the
 * layout of Embree 4.3 and later for packets of 1, 8 and 16: a packet of N has 48 N bytes of ray and 36 N of hit (1: 48).
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* Phases end after so many lanes; DELAY is some hundred milliseconds. */
enum { BATCH = 64, DELAY = 16, SETTLE = 1 << 14, PHASE = 1 << 16, RAY = 48, TFAR = 8, HIT_GEOM = 6, TURNS = 1 << 16 };

typedef void (*Packet)(const int *valid, void *scene, void *rays, void *args);
typedef void (*Single)(void *scene, void *rays, void *args);
typedef void (*Release)(void *scene);

struct Call { /* one packet as it was asked for */
    Packet packet;
    Single single;
    int lanes, hit;
    uint32_t flags, feature_mask;
};
struct Kept {
    size_t calls, turn; /* in which they were kept */
    struct Call call[PHASE + 1];
    char ray[PHASE + 16][RAY + 4]; /* the rays of each call, then its valid mask */
};
struct Arguments { /* those that Octolux gives: no context, no callbacks */
    uint32_t flags, feature_mask;
    void *context, *filter, *callback;
};
struct Turn {
    double rendering, replay[2]; /* of replay and kept: those of occluded, those of intersect */
    uint64_t kept[2];
};

static struct Kept *kept[DELAY];
static struct Turn *turns;
static size_t turn;
static enum { SETTLE_FIRST, FIRST, SETTLE_SECOND, SECOND } phase;
static int swapped, keeping;
static int lanes_left;
static void *scene_of;
static double begun, clock_costs, sum;

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void *some(size_t bytes) {
    void *memory = calloc(1, bytes);
    if (!memory) {
        fprintf(stderr, "ceiling: no memory\n");
        exit(1);
    }
    return memory;
}

static void begin(void *scene) {
    scene_of = scene;
    const char *wanted = getenv("OCTOLUX_CEILING");
    swapped = wanted && !strcmp(wanted, "swap");
    phase = SETTLE_FIRST, lanes_left = SETTLE, turn = 0, keeping = 0;
    if (!turns) turns = some(TURNS * sizeof *turns);
    for (int i = 0; i < DELAY; i++) {
        if (!kept[i]) kept[i] = some(sizeof *kept[i]);
        kept[i]->calls = kept[i]->turn = 0;
    }
    double first = now();
    for (int i = 0; i < 10000; i++) now();
    clock_costs = (now() - first) / 10001;
}

static void replay(const struct Kept *k) {
    struct Turn *t = &turns[k->turn];
    static _Alignas(64) char hot[BATCH][16 * (RAY + 4)];
    _Alignas(64) char packet[16 * 84];
    size_t at = 0;
    for (size_t first = 0, end; first < k->calls; first = end) {
        for (end = first; end < k->calls && end < first + BATCH && k->call[end].hit == k->call[first].hit; end++) {
            memcpy(hot[end - first], k->ray[at], (size_t)k->call[end].lanes * (RAY + 4));
            at += (size_t)k->call[end].lanes;
        }
        double from = now();
        for (size_t i = first; i < end; i++) {
            const struct Call *c = &k->call[i];
            struct Arguments args = {c->flags, c->feature_mask, 0, 0, 0};
            const char *packet_of = hot[i - first];
            size_t n = (size_t)c->lanes;
            memcpy(packet, packet_of, n * RAY);
            if (c->hit) memset(packet + n * RAY + n * 4 * HIT_GEOM, 0xff, n * 4);
            if (c->single) c->single(scene_of, packet, &args);
            else c->packet((const int *)(packet_of + n * RAY), scene_of, packet, &args);
            float tfar;
            memcpy(&tfar, packet + n * 4 * TFAR, 4);
            sum += tfar < 0 ? 1 : 0;
        }
        t->replay[k->call[first].hit] += now() - from - clock_costs;
    }
}

static void next_phase(void) {
    if (phase == SETTLE_FIRST || phase == SETTLE_SECOND) {
        phase++, lanes_left = PHASE;
        keeping = phase == (swapped ? FIRST : SECOND);
        if (keeping) {
            struct Kept *k = kept[turn % DELAY];
            replay(k);
            k->calls = 0, k->turn = turn;
        } else {
            begun = now();
        }
        return;
    }
    if (!keeping) turns[turn].rendering = now() - begun - clock_costs;
    keeping = 0;
    if (phase == SECOND && turn + 1 < TURNS) turn++;
    phase = phase == SECOND ? SETTLE_FIRST : SETTLE_SECOND, lanes_left = SETTLE;
}

static inline __attribute__((always_inline)) void note(Packet packet, Single single, int lanes, int hit, const int *valid,
                                                       void *scene, const void *ray, const struct Arguments *args) {
    if (scene != scene_of) { /* a test of the program's own came before */
        if (!args) return;
        begin(scene);
    }
    if (lanes_left <= 0) next_phase();
    lanes_left -= lanes;
    if (!keeping) return;
    struct Kept *k = kept[turn % DELAY];
    size_t at = (size_t)(PHASE - lanes_left - lanes);
    k->call[k->calls++] = (struct Call){packet, single, lanes, hit, args->flags, args->feature_mask};
    for (int i = 0; i < lanes; i++) turns[turn].kept[hit] += valid ? valid[i] != 0 : 1;
    memcpy(k->ray[at], ray, (size_t)lanes * RAY);
    if (valid) memcpy((char *)k->ray[at] + lanes * RAY, valid, (size_t)lanes * 4);
}

void rtcReleaseScene(void *scene) {
    static Release next;
    if (!next) next = (Release)dlsym(RTLD_NEXT, "rtcReleaseScene");
    if (scene == scene_of) {
        for (size_t i = 0; i < DELAY; i++)
            if (kept[i]->turn < turn) replay(kept[i]);
        printf("{\"turns\": [");
        const char *comma = "";
        for (const struct Turn *t = turns; t < turns + turn; t++) {
            printf("%s[%.9f, %lu, %lu, %.9f, %.9f]", comma, t->rendering, t->kept[1], t->kept[0], t->replay[1], t->replay[0]);
            comma = ", ";
        }
        printf("], \"occluded\": %.0f}\n", sum);
        fflush(stdout);
        memset(turns, 0, TURNS * sizeof *turns);
        scene_of = NULL; /* a later scene may get its address */
    }
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
