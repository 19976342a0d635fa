/* Loads a LinuxCNC kinematics module without LinuxCNC and asks it for joints.
 *
 *     kinematics_host MODULE.so JOINTS < input
 *
 * Input lines: "setp PIN VALUE" as in a HAL file, and "pose X Y Z A B C"; each pose is answered with
 * a line of JOINTS values. The HAL calls that a module makes are answered from a table of pins.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "hal.h"
#include "kinematics.h"

struct pin {
    char name[HAL_NAME_LEN + 1];
    double *value; /* NULL where the pin is no float */
};

static struct pin table[1024];
static int pins;

int hal_init(const char *name) { (void)name; return 1; }
int hal_ready(int component) { (void)component; return 0; }
int hal_exit(int component) { (void)component; return 0; }
void *hal_malloc(long size) { return calloc(1, (size_t)size); }

void rtapi_print(const char *format, ...) { (void)format; }
void rtapi_print_msg(msg_level_t level, const char *format, ...) { (void)level; (void)format; }

int rtapi_snprintf(char *buffer, unsigned long size, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    int written = vsnprintf(buffer, size, format, arguments);
    va_end(arguments);
    return written;
}

static void *new_pin(int is_float, const char *format, va_list arguments)
{
    struct pin *pin = &table[pins++];
    vsnprintf(pin->name, sizeof pin->name, format, arguments);
    void *place = calloc(1, sizeof(double));
    pin->value = is_float ? place : NULL;
    return place;
}

#define NEWF(function, type, is_float)                                                             \
    int function(hal_pin_dir_t way, type **place, int component, const char *format, ...)          \
    {                                                                                              \
        va_list arguments;                                                                         \
        (void)way, (void)component;                                                                \
        va_start(arguments, format);                                                               \
        *place = new_pin(is_float, format, arguments);                                             \
        va_end(arguments);                                                                         \
        return 0;                                                                                  \
    }
NEWF(hal_pin_float_newf, hal_float_t, 1)
NEWF(hal_pin_bit_newf, hal_bit_t, 0)
NEWF(hal_pin_u32_newf, hal_u32_t, 0)
NEWF(hal_pin_s32_newf, hal_s32_t, 0)

static void *named(int is_float, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    void *place = new_pin(is_float, format, arguments);
    va_end(arguments);
    return place;
}

#define NEW(function, type, is_float)                                                              \
    int function(const char *name, hal_pin_dir_t way, type **place, int component)                 \
    {                                                                                              \
        (void)way, (void)component;                                                                \
        *place = named(is_float, "%s", name);                                                      \
        return 0;                                                                                  \
    }
NEW(hal_pin_float_new, hal_float_t, 1)
NEW(hal_pin_bit_new, hal_bit_t, 0)
NEW(hal_pin_u32_new, hal_u32_t, 0)
NEW(hal_pin_s32_new, hal_s32_t, 0)

int hal_param_float_newf(hal_param_dir_t way, hal_float_t *place, int component, const char *format,
                         ...)
{
    va_list arguments;
    (void)way, (void)component;
    va_start(arguments, format);
    new_pin(1, format, arguments);
    va_end(arguments);
    table[pins - 1].value = (double *)place;
    return 0;
}

static int set_pin(const char *name, double value)
{
    for (int at = 0; at < pins; at++) {
        if (table[at].value && strcmp(table[at].name, name) == 0) {
            *table[at].value = value;
            return 0;
        }
    }
    fprintf(stderr, "no pin %s\n", name);
    return 1;
}

int main(int count, char **words)
{
    if (count != 3) return 2;
    void *module = dlopen(words[1], RTLD_NOW | RTLD_GLOBAL);
    if (!module) {
        fprintf(stderr, "%s\n", dlerror());
        return 1;
    }
    int joints = atoi(words[2]);
    int (*start)(void) = (int (*)(void))dlsym(module, "rtapi_app_main");
    int (*inverse)(const EmcPose *, double *, const KINEMATICS_INVERSE_FLAGS *,
                   KINEMATICS_FORWARD_FLAGS *) =
        (int (*)(const EmcPose *, double *, const KINEMATICS_INVERSE_FLAGS *,
                 KINEMATICS_FORWARD_FLAGS *))dlsym(module, "kinematicsInverse");
    if (!start || !inverse || start()) return 1;
    char line[512], name[128];
    while (fgets(line, sizeof line, stdin)) {
        double v[6];
        if (sscanf(line, "setp %127s %lf", name, &v[0]) == 2) {
            if (set_pin(name, v[0])) return 1;
        } else if (sscanf(line, "pose %lf %lf %lf %lf %lf %lf", v, v + 1, v + 2, v + 3, v + 4,
                          v + 5) == 6) {
            EmcPose pose = {{v[0], v[1], v[2]}, v[3], v[4], v[5], 0, 0, 0};
            double found[16] = {0};
            KINEMATICS_INVERSE_FLAGS in = 0;
            KINEMATICS_FORWARD_FLAGS out = 0;
            if (inverse(&pose, found, &in, &out)) return 1;
            for (int joint = 0; joint < joints; joint++) printf(" %.17g", found[joint]);
            printf("\n");
        } else if (line[0] != '#' && line[0] != '\n') {
            fprintf(stderr, "cannot read: %s", line);
            return 1;
        }
    }
    return 0;
}
