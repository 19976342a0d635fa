/* A LinuxCNC kinematics module without LinuxCNC: the few HAL calls that one makes, answered here.
 *
 *     gcc -O2 -shared -fPIC -DRTAPI -DUSPACE -I/usr/include/linuxcnc kinematics_host.c -o host.so
 *
 * Load this with RTLD_GLOBAL, then the module, then call its rtapi_app_main. Pins are re-pointed by
 * host_connect and host_disconnect as HAL does it: a pin without a signal points to a place of its
 * own, one with a signal to the signal's value; either way the value is carried over.
 */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "emcpos.h"
#include "hal.h"
#include "kinematics.h"

#define MOST 16384

typedef union {
    hal_bit_t bit;
    hal_u32_t u32;
    hal_s32_t s32;
    hal_float_t real;
} value;

static struct item {
    char name[HAL_NAME_LEN + 1];
    char type;          /* b u s f */
    void **pointer;     /* of a pin: where the module keeps its address */
    value *own;         /* of a pin without a signal */
    void *fixed;        /* of a parameter */
} item[MOST];
static int items;

static struct { char name[HAL_NAME_LEN + 1]; void (*call)(void *, long); void *argument; } function[MOST];
static int functions;

static struct item *add(char type, const char *format, va_list words)
{
    struct item *new;
    if (items == MOST)
        abort();
    new = &item[items++];
    new->type = type;
    /* A name that is too long is an error in HAL. */
    if (vsnprintf(new->name, sizeof new->name, format, words) >= (int)sizeof new->name)
        abort();
    return new;
}

static int add_pin(char type, void **pointer, const char *format, va_list words)
{
    struct item *new = add(type, format, words);
    new->own = calloc(1, sizeof *new->own);
    new->pointer = pointer;
    *pointer = new->own;
    return 0;
}

#define PIN(KIND, LETTER) \
int hal_pin_##KIND##_newf(hal_pin_dir_t dir, hal_##KIND##_t **pointer, int id, const char *format, ...) \
{ \
    va_list words; int result; \
    (void)dir; (void)id; \
    va_start(words, format); \
    result = add_pin(LETTER, (void **)pointer, format, words); \
    va_end(words); \
    return result; \
} \
int hal_pin_##KIND##_new(const char *name, hal_pin_dir_t dir, hal_##KIND##_t **pointer, int id) \
{ \
    return hal_pin_##KIND##_newf(dir, pointer, id, "%s", name); \
}
PIN(bit, 'b')
PIN(u32, 'u')
PIN(s32, 's')
PIN(float, 'f')

int hal_param_float_newf(hal_param_dir_t dir, hal_float_t *where, int id, const char *format, ...)
{
    va_list words;
    (void)dir; (void)id;
    va_start(words, format);
    add('f', format, words)->fixed = (void *)where;
    va_end(words);
    return 0;
}

int hal_export_funct(const char *name, void (*call)(void *, long), void *argument, int uses_fp,
                     int reentrant, int id)
{
    (void)uses_fp; (void)reentrant; (void)id;
    if (functions == MOST || strlen(name) > HAL_NAME_LEN)
        abort();
    strcpy(function[functions].name, name);
    function[functions].call = call;
    function[functions++].argument = argument;
    return 0;
}

int hal_init(const char *name) { (void)name; return 1; }
int hal_exit(int id) { (void)id; return 0; }
int hal_ready(int id) { (void)id; return 0; }
/* HAL's memory is not cleared. */
void *hal_malloc(long size) { void *p = malloc((size_t)size); return p ? memset(p, 0x5a, (size_t)size) : p; }
void rtapi_print_msg(msg_level_t level, const char *format, ...) { (void)level; (void)format; }
void rtapi_print(const char *format, ...) { (void)format; }

static struct item *find(const char *name)
{
    int i;
    for (i = items - 1; i >= 0; i--)    /* of two modules in turn, the one loaded last */
        if (strcmp(item[i].name, name) == 0)
            return &item[i];
    return NULL;
}

/* ---- for the program that loads modules ---- */

int host_items(void) { return items; }
const char *host_name(int number) { return item[number].name; }
char host_type(const char *name) { struct item *i = find(name); return i ? i->type : 0; }

static void *place(const char *name)
{
    struct item *i = find(name);
    return !i ? NULL : i->fixed ? i->fixed : *i->pointer;
}

double host_get(const char *name)
{
    value *v = place(name);
    switch (host_type(name)) {
    case 'b': return v->bit;
    case 'u': return v->u32;
    case 's': return v->s32;
    default: return v->real;
    }
}

int host_set(const char *name, double to)
{
    value *v = place(name);
    if (!v)
        return -1;
    switch (host_type(name)) {
    case 'b': v->bit = to != 0.0; break;
    case 'u': v->u32 = (rtapi_u32)to; break;
    case 's': v->s32 = (rtapi_s32)to; break;
    default: v->real = to;
    }
    return 0;
}

/* As `net`: the pin points to a new signal, which has its value. */
int host_connect(const char *name)
{
    struct item *i = find(name);
    value *signal;
    if (!i || !i->pointer)
        return -1;
    signal = calloc(1, sizeof *signal);
    *signal = *i->own;
    *i->pointer = signal;
    return 0;
}

/* As `unlinkp`: the pin keeps the signal's value in its own place. */
int host_disconnect(const char *name)
{
    struct item *i = find(name);
    if (!i || !i->pointer || *i->pointer == (void *)i->own)
        return -1;
    *i->own = *(value *)*i->pointer;
    *i->pointer = i->own;
    return 0;
}

int host_run(const char *name, long period)
{
    int i;
    for (i = functions - 1; i >= 0; i--)
        if (strcmp(function[i].name, name) == 0) {
            function[i].call(function[i].argument, period);
            return 0;
        }
    return -1;
}

typedef int inverse(const EmcPose *, double *, const KINEMATICS_INVERSE_FLAGS *, KINEMATICS_FORWARD_FLAGS *);
typedef int forward(const double *, EmcPose *, const KINEMATICS_FORWARD_FLAGS *, KINEMATICS_INVERSE_FLAGS *);

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

/* ns of one inverse, over `count` calls at poses a little apart; -1 where one fails. */
double host_time_inverse(inverse *call, const EmcPose *pose, int count)
{
    double joints[16], start = now(), failed = 0.0;
    KINEMATICS_INVERSE_FLAGS in = 0;
    KINEMATICS_FORWARD_FLAGS out = 0;
    int k;
    for (k = 0; k < count; k++) {
        EmcPose near = *pose;
        near.tran.x += 1e-6 * (k & 15);
        failed += call(&near, joints, &in, &out) != 0;
    }
    return failed > 0.0 ? -1.0 : (now() - start) / count;
}

/* ns of one forward solution from poses about `from`. */
double host_time_forward(forward *call, const double *joints, const EmcPose *from, int count)
{
    double start = now(), failed = 0.0;
    KINEMATICS_FORWARD_FLAGS in = 0;
    KINEMATICS_INVERSE_FLAGS out = 0;
    int k;
    for (k = 0; k < count; k++) {
        EmcPose pose = *from;
        pose.tran.x += 1e-6 * (k & 15);
        failed += call(joints, &pose, &in, &out) != 0;
    }
    return failed > 0.0 ? -1.0 : (now() - start) / count;
}
