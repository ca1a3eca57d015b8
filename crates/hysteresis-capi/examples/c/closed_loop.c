// A closed loop in memory of its own: closed_loop STAGE.json. The plant is simulated; at the bench it is the converters.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "mpi_hyst.h"

#define DT 1e-4      // s
#define SAMPLES 20000

// Where the objects lie: the largest of them and their alignment are what mpih_*_size and mpih_*_align say.
static union {
    uint64_t align;
    unsigned char bytes[4096];
} controller_memory, plant_memory;

static int failed(const char *what, mpih_status status) {
    if (status == MPIH_STATUS_OK) return 0;
    fprintf(stderr, "%s: %s: %s\n", what, mpih_status_name(status), mpih_last_error());
    return 1;
}

// A sine of 2 Hz between 5 and 25 um that begins at rest.
static double reference_at(int k) {
    return 15.0 - 10.0 * cos(2.0 * 3.14159265358979 * 2.0 * DT * k);
}

int main(int count, char **arguments) {
    if (count != 2) {
        fprintf(stderr, "closed_loop STAGE.json\n");
        return 1;
    }
    if (mpih_abi() != MPIH_ABI) {
        fprintf(stderr, "the library %s has another interface than the header\n", mpih_version());
        return 1;
    }

    mpih_stage *stage;
    if (failed("stage", mpih_stage_from_file(arguments[1], &stage))) return 1;
    for (size_t i = 0; i < mpih_stage_warning_count(stage); i++) printf("warning: %s\n", mpih_stage_warning(stage, i));
    mpih_properties properties;
    if (failed("properties", mpih_stage_properties(stage, &properties))) return 1;
    printf("drives from %g to %g %s\n", properties.drive_low, properties.drive_high, mpih_stage_drive_unit(stage));

    mpih_controller_options options;
    if (failed("options", mpih_controller_options_default(&options))) return 1;
    options.feedforward = MPIH_FEEDFORWARD_PREVIEW;
    mpih_controller *controller;
    mpih_forward *plant;
    if (failed("controller", mpih_controller_new(stage, DT, &options, controller_memory.bytes,
                                                 sizeof controller_memory.bytes, &controller)))
        return 1;
    if (failed("plant", mpih_forward_new(stage, DT, plant_memory.bytes, sizeof plant_memory.bytes, &plant))) return 1;

    // The loop: no allocation, no error path.
    int ahead = (int)mpih_controller_ahead(controller);
    double measured = mpih_forward_position(plant), squares = 0.0;
    for (int k = 0; k < SAMPLES; k++) {
        double error = reference_at(k) - measured;
        if (k >= SAMPLES / 2) squares += error * error;
        double drive = mpih_controller_step(controller, reference_at(k + ahead), measured);
        measured = mpih_forward_advance(plant, drive);
    }
    double rms = sqrt(squares / (SAMPLES / 2));
    printf("error %.2g %s rms\n", rms, mpih_stage_position_unit(stage));

    // Everything that the controller remembers, as text.
    size_t needed;
    if (failed("save", mpih_controller_save(controller, NULL, 0, &needed))) return 1;
    char *state = malloc(needed);
    if (state == NULL || failed("save", mpih_controller_save(controller, state, needed, NULL))) return 1;
    double next = mpih_controller_step(controller, 5.0, measured);
    if (failed("load", mpih_controller_load(controller, state))) return 1;
    int same = mpih_controller_step(controller, 5.0, measured) == next;
    free(state);

    // Down to 0 V at 200 V/s, whatever comes; then the end.
    if (failed("stop", mpih_controller_stop(controller, 200.0, 0.0))) return 1;
    double drive = 0.0;
    for (int k = 0; k < SAMPLES; k++) drive = mpih_controller_step(controller, NAN, NAN);
    mpih_controller_free(controller);
    mpih_forward_free(plant);
    mpih_stage_free(stage);
    printf("stopped at %g\n", drive);
    return !(rms < 1e-5 && same && drive == 0.0);
}
