// A million mixed samples through everything that a stage makes, written as numbers to a file: same_bits STAGE.json OUTPUT.
// The library in Rust and the Python package give the same bytes. checks/same-bits says what is computed.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "mpi_hyst.h"

#define SAMPLES 1000000
#define DT 1e-4
#define SHIFT 503

// Smooth, noise, jumps, beyond every limit, and not finite, by turns.
typedef struct {
    uint64_t random, k;
    double level;
} mixed;

static double mixed_next(mixed *signal) {
    uint64_t k = signal->k++, r = signal->random;
    r ^= r >> 12;
    r ^= r << 25;
    r ^= r >> 27;
    signal->random = r;
    double noise = (double)((r * UINT64_C(0x2545F4914F6CDD1D)) >> 11) / 4503599627370496.0 - 1.0;
    if (k % 50 == 0) signal->level = noise;
    uint64_t phase = k % 2000;
    double triangle = (double)(phase < 1000 ? phase : 2000 - phase) / 500.0 - 1.0;
    switch (k / 1000 % 5) {
        case 0: return triangle;
        case 1: return noise;
        case 2: return signal->level;
        case 3: return 2.0 * triangle;
        default: break;
    }
    if (k % 7 == 0) return NAN;
    if (k % 11 == 0) return INFINITY;
    if (k % 13 == 0) return -1e200;
    return triangle;
}

static void check(mpih_status status) {
    if (status != MPIH_STATUS_OK) {
        fprintf(stderr, "%s: %s\n", mpih_status_name(status), mpih_last_error());
        exit(1);
    }
}

static double output[SAMPLES], estimates[SAMPLES];

static void keep(FILE *file, const double *numbers) {
    if (fwrite(numbers, sizeof *numbers, SAMPLES, file) != SAMPLES) {
        perror("output");
        exit(1);
    }
}

static void open_loop(const mpih_stage *stage, FILE *file) {
    mpih_forward *forward;
    check(mpih_forward_new(stage, DT, NULL, 0, &forward));
    mixed s = {1, 0, 0.0};
    for (int k = 0; k < SAMPLES; k++) output[k] = 60.0 + 90.0 * mixed_next(&s);
    check(mpih_forward_run(forward, output, output, SAMPLES));
    keep(file, output);
    mpih_forward_free(forward);

    mpih_inverse *inverse;
    check(mpih_inverse_new(stage, DT, NAN, NAN, NULL, 0, &inverse));
    s = (mixed){1, 0, 0.0};
    for (int k = 0; k < SAMPLES; k++) output[k] = mpih_inverse_step(inverse, 14.0 + 18.0 * mixed_next(&s));
    keep(file, output);
    mpih_inverse_free(inverse);
}

static void plant_alone(const mpih_stage *stage, FILE *file) {
    mpih_forward *plant;
    check(mpih_forward_new(stage, DT, NULL, 0, &plant));
    mixed s = {1, 0, 0.0};
    for (int k = 0; k < SAMPLES; k++) output[k] = mpih_forward_advance(plant, 60.0 + 90.0 * mixed_next(&s));
    keep(file, output);
    mpih_forward_free(plant);
}

// With `finite` a reference that is none is the last one, as a loop in real time has it.
static void closed_loop(const mpih_stage *stage, bool finite) {
    mpih_forward *plant;
    mpih_controller *controller;
    mpih_observer *observer;
    check(mpih_forward_new(stage, DT, NULL, 0, &plant));
    check(mpih_controller_new(stage, DT, NULL, NULL, 0, &controller));
    check(mpih_observer_new(stage, DT, 0.5, NAN, NULL, 0, &observer));
    mixed s = {1, 0, 0.0}, d = {2, 0, 0.0};
    for (int k = 0; k < SHIFT; k++) mixed_next(&d);
    double drive = 0.0, position = 0.0, last = 14.0;
    for (int k = 0; k < SAMPLES; k++) {
        double reference = 14.0 + 18.0 * mixed_next(&s), bad = mixed_next(&d);
        if (finite && !(fabs(reference) < 1e100)) reference = last;
        last = reference;
        double measured = fabs(bad) < 1e100 ? position : bad;
        estimates[k] = mpih_observer_step(observer, drive, measured);
        drive = output[k] = mpih_controller_step(controller, reference, measured);
        position = mpih_forward_advance(plant, drive);
    }
    mpih_observer_free(observer);
    mpih_controller_free(controller);
    mpih_forward_free(plant);
}

int main(int count, char **arguments) {
    if (count != 3) {
        fprintf(stderr, "same_bits STAGE.json OUTPUT\n");
        return 1;
    }
    mpih_stage *stage;
    check(mpih_stage_from_file(arguments[1], &stage));
    FILE *file = fopen(arguments[2], "wb");
    if (file == NULL) {
        perror(arguments[2]);
        return 1;
    }
    open_loop(stage, file);
    closed_loop(stage, false);
    keep(file, output);
    keep(file, estimates);
    plant_alone(stage, file);
    closed_loop(stage, true);
    keep(file, output);
    mpih_stage_free(stage);
    return fclose(file) != 0;
}
