// Two axes in a closed loop, and an oscillator with hysteresis inside: axes AXES.json OSCILLATOR.json OUTPUT. What runs is
// written to the output as numbers. The plants are simulated; at the bench they are the converters.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "mpi_hyst.h"

#define AXES 2
#define SAMPLES 2000
#define OSCILLATOR_DT 2.5e-4 // s

static void check(mpih_status status) {
    if (status != MPIH_STATUS_OK) {
        fprintf(stderr, "%s: %s\n", mpih_status_name(status), mpih_last_error());
        exit(1);
    }
}

static void keep(FILE *file, const double *numbers, size_t count) {
    if (fwrite(numbers, sizeof *numbers, count, file) != count) {
        perror("output");
        exit(1);
    }
}

// A step of the oscillator's drive and of the references now and then: sums of these are the same on every machine.
static double square(int k, int period) {
    return (k / period) % 2 == 0 ? 0.5 : -0.25;
}

// The loop of both axes: returns the largest error at the end of a step.
static double both_axes(const char *path, FILE *file) {
    static double drives[SAMPLES][AXES], positions[SAMPLES][AXES];
    mpih_axes_stage *stage;
    mpih_axes_controller *controller;
    mpih_axes_forward *plant;
    check(mpih_axes_stage_from_file(path, &stage));
    if (mpih_axes_stage_drives(stage) != AXES || mpih_axes_stage_positions(stage) != AXES) exit(1);
    const double limits[AXES][2] = {{-9.0, 9.0}, {-9.0, 9.0}};
    mpih_axes_controller_options options;
    check(mpih_axes_controller_options_default(&options));
    options.slew = 4000.0;
    // What no sensor can show, in the unit of the drives: three times their limits.
    const double possible[AXES][2] = {{-27.0, 27.0}, {-27.0, 27.0}};
    options.measurement_range = possible[0];
    check(mpih_axes_controller_new(stage, limits[0], AXES, &options, NULL, 0, &controller));
    check(mpih_axes_forward_new(stage, NULL, 0, &plant));
    mpih_axes_stage_free(stage);

    int ahead = (int)mpih_axes_controller_ahead(controller);
    double measured[AXES] = {0.3, -0.2}, worst = 0.0;
    for (int k = 0; k < SAMPLES; k++) {
        double references[AXES] = {0.3 + square(k + ahead, 400), -0.2 + square(k + ahead, 300)};
        // Now and then there is no measurement.
        double seen[AXES] = {measured[0], k % 97 == 0 ? NAN : measured[1]};
        check(mpih_axes_controller_step(controller, references, seen, drives[k]));
        check(mpih_axes_forward_advance(plant, drives[k], measured));
        for (int i = 0; i < AXES; i++) positions[k][i] = measured[i];
        if (k % 400 == 390) worst = fmax(worst, fabs(measured[0] - 0.3 - square(k, 400)));
    }
    keep(file, drives[0], SAMPLES * AXES);
    keep(file, positions[0], SAMPLES * AXES);

    // Everything that the controller remembers, as text.
    size_t needed;
    check(mpih_axes_controller_save(controller, NULL, 0, &needed));
    char *state = malloc(needed);
    if (state == NULL) exit(1);
    check(mpih_axes_controller_save(controller, state, needed, NULL));
    double next[AXES], again[AXES];
    check(mpih_axes_controller_step(controller, measured, measured, next));
    check(mpih_axes_controller_load(controller, state));
    check(mpih_axes_controller_step(controller, measured, measured, again));
    free(state);
    if (next[0] != again[0] || next[1] != again[1]) exit(1);

    // Somebody else had the amplifiers: all begins anew from where they are now, without feedback for a while.
    const double elsewhere[AXES] = {1.0, -1.0};
    check(mpih_axes_controller_reset_at(controller, elsewhere, AXES));
    check(mpih_axes_controller_set_mode(controller, MPIH_MODE_FEEDFORWARD));
    for (int k = 0; k < 10; k++) check(mpih_axes_controller_step(controller, measured, measured, next));
    check(mpih_axes_controller_set_mode(controller, MPIH_MODE_RUN));

    // To rest at 200 a second, whatever comes.
    const double rest[AXES] = {0.0, 0.0};
    check(mpih_axes_controller_stop(controller, 200.0, rest, AXES));
    for (int k = 0; k < 200; k++) check(mpih_axes_controller_step(controller, rest, rest, next));
    printf("stopped at %g and %g\n", next[0], next[1]);
    mpih_axes_controller_free(controller);
    mpih_axes_forward_free(plant);
    return worst;
}

static void oscillator(const char *path, FILE *file) {
    static double drives[SAMPLES], positions[SAMPLES];
    mpih_oscillator *oscillator;
    mpih_oscillator_forward *forward;
    check(mpih_oscillator_from_file(path, &oscillator));
    check(mpih_oscillator_forward_new(oscillator, OSCILLATOR_DT, 0, NULL, 0, &forward));
    mpih_oscillator_free(oscillator);
    for (int k = 0; k < SAMPLES; k++) drives[k] = k % 101 == 0 ? NAN : 100.0 * square(k, 130);
    check(mpih_oscillator_forward_run(forward, drives, positions, SAMPLES));
    printf("%d drives were no numbers\n", (int)mpih_oscillator_forward_rejected(forward));
    keep(file, positions, SAMPLES);
    mpih_oscillator_forward_free(forward);
}

int main(int count, char **arguments) {
    if (count != 4) {
        fprintf(stderr, "axes AXES.json OSCILLATOR.json OUTPUT\n");
        return 1;
    }
    FILE *file = fopen(arguments[3], "wb");
    if (file == NULL) {
        perror(arguments[3]);
        return 1;
    }
    double worst = both_axes(arguments[1], file);
    oscillator(arguments[2], file);
    printf("error at the end of a step: %.1e\n", worst);
    return fclose(file) != 0 || worst > 1e-3;
}
