// mpi_hyst: hysteresis of piezo stages, its exact inverse, and control, from a stage file. docs/c.md is where to begin.
// This file is made from the sources by `make header`; a test compares the two.
//
// Memory. mpih_*_new puts an object into memory of the caller, of mpih_*_size bytes at a multiple of mpih_*_align, or on the
// heap where that is NULL. What an object holds besides (the memory of the hysteresis, delays, matrices) is taken from the heap
// by mpih_*_new in either case, and given back by mpih_*_free. An object in memory of the caller must not be moved or copied,
// and must be ended before its memory is used again. Where mpih_*_new fails the pointer becomes NULL.
//
// The loop. step, step_given, peek, plan, commit, advance, run, hold, release and what reads one number never allocate, lock,
// log or read a clock, and cannot fail. Bad numbers hold the output and are counted. A call with NULL instead of an object
// returns NaN, 0 or false: check the status of mpih_*_new once. Loops of several axes return a status, which is MPIH_STATUS_OK
// unless a pointer is NULL.
//
// Configuration returns a status. Where it is not MPIH_STATUS_OK, mpih_last_error has the message, for each thread its own.
//
// What the caller must keep. A pointer is NULL or points to what its name says. An array has as many numbers as `n` says;
// one of rows has a number for each axis in every row, the rows one behind the other. Arrays of one call are the same, where
// their rows are as long, or do not overlap. An object is used by one thread at a time, a stage by any number at once.
// Texts are UTF-8 and end with a zero byte.

#ifndef MPI_HYST_H
#define MPI_HYST_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// The number of this interface. It changes when a function or a struct changes in a way that compiled programs notice.
#define MPIH_ABI 1

// What became of a call. Everything but MPIH_STATUS_OK has a message: mpih_last_error.
enum mpih_status
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    // Done.
    MPIH_STATUS_OK = 0,
    // A pointer is NULL that must not be.
    MPIH_STATUS_NULL = 1,
    // The memory of the caller is too small for the object, or not aligned for it.
    MPIH_STATUS_MEMORY = 2,
    // An argument, or a number in the file, is outside its domain.
    MPIH_STATUS_ARGUMENT = 3,
    // The hysteresis has no inverse: its slope may vanish or turn negative.
    MPIH_STATUS_NOT_INVERTIBLE = 4,
    // A file cannot be read.
    MPIH_STATUS_FILE = 5,
    // A text, or bytes, are no stage, no model or no saved state.
    MPIH_STATUS_FORMAT = 6,
    // A saved state belongs to another object, or the object cannot be in it.
    MPIH_STATUS_STATE = 7,
    // The buffer for a text is too small; the size that is needed has been told.
    MPIH_STATUS_BUFFER = 8,
    // A defect of the library. Free the object: it may be in any state.
    MPIH_STATUS_INTERNAL = 9,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum mpih_status mpih_status;
#else
typedef int32_t mpih_status;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// What a controller does with its samples.
enum mpih_mode
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    // Feed-forward and feedback.
    MPIH_MODE_RUN = 0,
    // Feed-forward alone; the integral is frozen and stays part of the drive.
    MPIH_MODE_FEEDFORWARD = 1,
    // The drive stays.
    MPIH_MODE_HOLD = 2,
    // The drive goes to a rest drive at a given rate and stays there: mpih_controller_stop.
    MPIH_MODE_STOP = 3,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum mpih_mode mpih_mode;
#else
typedef int32_t mpih_mode;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Where the feed-forward of a controller comes from.
enum mpih_feedforward
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    // The exact inverse of the reference of now.
    MPIH_FEEDFORWARD_INVERSE = 0,
    // The exact inverse of a target made of references that come early (mpih_controller_ahead samples): through the
    // inverse of amplifier, modes and dead time too.
    MPIH_FEEDFORWARD_PREVIEW = 1,
    // Drives that come with every sample: mpih_controller_step_given.
    MPIH_FEEDFORWARD_GIVEN = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum mpih_feedforward mpih_feedforward;
#else
typedef int32_t mpih_feedforward;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Feed-forward and feedback that lead all drives of a stage of several axes, within limits and slew rates.
typedef struct mpih_axes_controller mpih_axes_controller;

// A stage of several axes sample by sample, from the drives to the positions. A simulated plant, or the model beside a
// real one.
typedef struct mpih_axes_forward mpih_axes_forward;

// A stage of several axes: what the file of a MultiAxisStage says. It never changes, so several threads may use it at
// once. What is made from it keeps what it needs: the stage may be freed before.
typedef struct mpih_axes_stage mpih_axes_stage;

// Feed-forward and proportional-integral feedback, sample by sample, within limits and slew rate.
typedef struct mpih_controller mpih_controller;

// The whole stage sample by sample, from the drive to the position: dead time, amplifier, maps, hysteresis, loop
// shift, creep and modes. A simulated plant, or the model beside a real one.
typedef struct mpih_forward mpih_forward;

// The exact inverse of maps, hysteresis, loop shift and creep, sample by sample: the drive that brings the position to
// the target. Modes, amplifier and dead time are not part of it. The drive never leaves its limits.
typedef struct mpih_inverse mpih_inverse;

// What the model of a stage and a noisy measurement say together of the position: a Kalman filter. Feed its estimate
// to the controller instead of the measurement.
typedef struct mpih_observer mpih_observer;

// An oscillator with hysteresis inside: what the file of a HystereticOscillator says. It never changes, so several
// threads may use it at once. What is made from it keeps what it needs: the oscillator may be freed before.
typedef struct mpih_oscillator mpih_oscillator;

// An oscillator sample by sample, from the drive to the position, integrated in sub-steps.
typedef struct mpih_oscillator_forward mpih_oscillator_forward;

// A stage: what a stage file says of an actuator. It never changes, so several threads may use it at once. What is
// made from it keeps what it needs: the stage may be freed before.
typedef struct mpih_stage mpih_stage;

// How a controller of several axes is set up. Fill it with mpih_axes_controller_options_default first, then change
// what you need.
typedef struct {
    // How fast each drive may move, per second; NaN or infinity for no bound.
    double slew;
    // By how much the feedback may at most amplify what disturbs a position, at any frequency: 1.05 to 5; NaN for 2.
    double peak_sensitivity;
    // How long a motion takes from where it starts to its references, and a change to vanish, in seconds; NaN for 5
    // ms.
    double bumpless_time;
    // How many samples early references come, 1 to 512; -1 for as many as the dynamics use.
    int32_t ahead;
    // For how many measurements in a row that are missing the estimate stands in, before feed-forward goes on alone;
    // -1 for 10.
    int32_t max_missing;
    // A row for each drive, the lowest and the highest measurement that can be, as its controller sees it: in the
    // unit of the drive, what mpih_axes_controller_decoupling makes of the positions. A row of NaN is for no bounds,
    // NULL for none at all. A measurement that cannot be moves no estimate.
    const double *measurement_range;
    // For each drive the largest change of that from one sample to the next; NaN for no bound, NULL for none at all.
    const double *max_measurement_step;
} mpih_axes_controller_options;

// How many samples were unusual.
typedef struct {
    // References, or given feed-forwards, that were not finite (or beyond 1e100), or feed-forwards that did not come.
    uint64_t rejected;
    // Measurements that were not finite (or beyond 1e100).
    uint64_t missing;
    // Measurements that were finite but cannot be.
    uint64_t implausible;
    // Unlimited drives beyond the limits.
    uint64_t saturated;
    // Unlimited drives farther from the last drive than the slew allows.
    uint64_t slewing;
} mpih_counters;

// How a controller is set up. Fill it with mpih_controller_options_default first, then change what you need. NaN
// stands for what the stage says.
typedef struct {
    // The lowest drive; both limits are given or none. They lie within those of the stage.
    double limit_low;
    // The highest drive.
    double limit_high;
    // The proportional gain, in V/um. Both gains are given or none: without them gains and filters are tuned for the
    // stage.
    double kp;
    // The integral gain, in V/um/s.
    double ki;
    // How fast the drive may move, per second; infinity for no bound.
    double slew;
    // The drive that the amplifier has at the start; NaN for 0 or the limit nearest to it.
    double start_drive;
    // How long the difference at a start or a switch takes to go to zero, in seconds; NaN for 5 ms.
    double bumpless_time;
    // The lowest measurement that the sensor can show; both ends are given or none. NaN for a stroke beyond the
    // positions.
    double measurement_low;
    // The highest measurement that the sensor can show.
    double measurement_high;
    // The largest change of the measurement from one sample to the next; NaN for no bound.
    double max_measurement_step;
    // Over how many seconds references with steps and corners are smoothed; 0 for not at all. With
    // MPIH_FEEDFORWARD_PREVIEW only. The `smoothing` of the properties of a stage leaves its modes at rest.
    double smoothing;
    // One of the numbers of mpih_feedforward.
    int32_t feedforward;
    // How many samples early references come, before smoothing; -1 for as many as the stage needs. With
    // MPIH_FEEDFORWARD_PREVIEW only.
    int32_t ahead;
    // How many measurements in a row may be missing, the drive being held, before feed-forward goes on alone; -1 for 10. Where
    // losses follow each other within the bumpless time, the last error stands in.
    int32_t max_missing;
    // 0.
    int32_t reserved;
} mpih_controller_options;

// The terms of the last sample that was acted upon: the first four in the unit of the measurement, the others in that
// of the drive. `unlimited_drive` = `feedforward` + `proportional` + `integral` + `bumpless`.
typedef struct {
    // The reference of the feedback. With a preview it is the one that came `ahead` samples before the newest.
    double reference;
    // The target of the feed-forward.
    double target;
    // Reference minus measurement. Without a usable measurement it is the last error there was.
    double error;
    // The error behind the filters.
    double filtered_error;
    // The output of the feed-forward, or the drive that came instead.
    double feedforward;
    // kp times the filtered error.
    double proportional;
    // The sum of ki dt times the filtered errors.
    double integral;
    // What keeps starts and switches from being jumps.
    double bumpless;
    // The drive that the law asks for, before limits and slew.
    double unlimited_drive;
    // The drive that goes out.
    double drive;
    // 1 if the unlimited drive lay beyond the limits, else 0.
    int32_t saturated;
    // 1 if the unlimited drive was farther from the last drive than the slew allows, else 0.
    int32_t slewing;
} mpih_terms;

// What a stage says of itself. A number that the stage does not state is NaN. Drives and positions are in the units of
// the stage (V and um by default), times in seconds.
typedef struct {
    // The lowest drive that the hardware takes.
    double limit_low;
    // The highest drive that the hardware takes.
    double limit_high;
    // The lowest drive of what is made from the stage, unless told: the limit, or the lowest drive that was
    // identified.
    double drive_low;
    // The highest drive of what is made from the stage, unless told.
    double drive_high;
    // The lowest position that the stage reaches between these drives whatever happened before: the end of its slow
    // loop.
    double position_low;
    // The highest position that it reaches in the same sense.
    double position_high;
    // The drive at rest: 0, or the limit nearest to it.
    double rest_drive;
    // What the sensor shows later than hysteresis and modes explain.
    double dead_time;
    // How fast the drive may change, per second.
    double slew;
    // The rms noise of the sensor.
    double noise;
    // The lowest slope of the position over the drive.
    double slope_low;
    // The highest slope of the position over the drive.
    double slope_high;
    // For how long a reference must be smoothed so that its steps leave lightly damped modes at rest; 0 without such
    // modes.
    double smoothing;
} mpih_properties;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// The number of the interface that the library has: compare it with MPIH_ABI, that of the header.
uint32_t mpih_abi(void);

// The version of the library, such as "0.1.0".
const char *mpih_version(void);

// Reads a stage of several axes from the text of its file. `text` is UTF-8 and ends with a zero byte. Free the stage
// with mpih_axes_stage_free.
mpih_status mpih_axes_stage_from_json(const char *text, mpih_axes_stage **stage);

// Reads the file of a stage of several axes. `path` is UTF-8 and ends with a zero byte. Free the stage with
// mpih_axes_stage_free.
mpih_status mpih_axes_stage_from_file(const char *path, mpih_axes_stage **stage);

// An oscillator sampled every `dt` seconds as a stage of one axis, with 1 to 1000 steps in a sample: for
// mpih_axes_controller_new. Errors of what it shows go with the square of a step: on a public benchmark 0.2 to 2 %
// of the motion with 20 steps in its shortest period, 0.01 to 0.1 % with 80. To simulate finely take
// mpih_oscillator_forward_new. Free the stage with mpih_axes_stage_free.
mpih_status mpih_axes_stage_of_oscillator(const mpih_oscillator *oscillator,
                                          double dt,
                                          size_t sub_steps,
                                          mpih_axes_stage **stage);

// Frees a stage of several axes; nothing for NULL.
void mpih_axes_stage_free(mpih_axes_stage *stage);

// The number of drives. 0 for NULL.
size_t mpih_axes_stage_drives(const mpih_axes_stage *stage);

// The number of positions. 0 for NULL.
size_t mpih_axes_stage_positions(const mpih_axes_stage *stage);

// The sampling interval in seconds, which is part of the stage. NaN for NULL.
double mpih_axes_stage_dt(const mpih_axes_stage *stage);

// How many bytes mpih_axes_forward_new needs.
size_t mpih_axes_forward_size(void);

// Of which number the address of the memory for mpih_axes_forward_new must be a multiple.
size_t mpih_axes_forward_align(void);

// Makes a forward model of a stage of several axes at rest, in `memory` of `bytes` bytes, or on the heap if `memory`
// is NULL. End it with mpih_axes_forward_free.
mpih_status mpih_axes_forward_new(const mpih_axes_stage *stage,
                                  void *memory,
                                  size_t bytes,
                                  mpih_axes_forward **forward);

// Ends a forward model: frees what it holds, and itself unless it lies in memory of the caller. Nothing for NULL.
void mpih_axes_forward_free(mpih_axes_forward *forward);

// A row of a record: writes the positions at this moment, t_k. The drives are then held until t_(k+1).
//
// A drive that is not finite counts as the last one of its axis. A step of the model that would bring a state beyond
// 1e100 leaves the states as they are, and is the last one of its interval. Both are counted. Fails for NULL alone.
mpih_status mpih_axes_forward_step(mpih_axes_forward *forward, const double *drives, double *positions);

// A plant in a loop: holds the drives for one sampling interval, then writes the positions at its end, just before the
// next drives. That is what a controller reads next. Bad drives are as for mpih_axes_forward_step. Fails for NULL
// alone.
mpih_status mpih_axes_forward_advance(mpih_axes_forward *forward, const double *drives, double *positions);

// mpih_axes_forward_step for `n` rows, one behind the other, bit for bit. Both arrays may be the same where rows of
// both are as long.
mpih_status mpih_axes_forward_run(mpih_axes_forward *forward, const double *drives, double *positions, size_t n);

// How many drives were not finite (or beyond 1e100), and how many samples would have brought a state beyond 1e100.
uint64_t mpih_axes_forward_rejected(const mpih_axes_forward *forward);

// Back to rest, all counts zero.
void mpih_axes_forward_reset(mpih_axes_forward *forward);

// Writes everything that the model remembers to `text`, as mpih_forward_save does.
mpih_status mpih_axes_forward_save(const mpih_axes_forward *forward, char *text, size_t bytes, size_t *needed);

// Goes on, bit for bit, from what mpih_axes_forward_save wrote for a model of the same stage. If it fails the model is
// as before.
mpih_status mpih_axes_forward_load(mpih_axes_forward *forward, const char *text);

// Leaves every option open (NaN, -1, NULL): what stands for it is chosen when the controller is made.
mpih_status mpih_axes_controller_options_default(mpih_axes_controller_options *options);

// How many bytes mpih_axes_controller_new needs.
size_t mpih_axes_controller_size(void);

// Of which number the address of the memory for mpih_axes_controller_new must be a multiple.
size_t mpih_axes_controller_align(void);

// Makes a controller of a stage with as many drives as positions, 16 at most, in `memory` of `bytes` bytes, or on the
// heap if `memory` is NULL. `limits` has `n` rows, the lowest and the highest drive of each. NULL for `options` stands
// for those of mpih_axes_controller_options_default. End it with mpih_axes_controller_free.
mpih_status mpih_axes_controller_new(const mpih_axes_stage *stage,
                                     const double *limits,
                                     size_t n,
                                     const mpih_axes_controller_options *options,
                                     void *memory,
                                     size_t bytes,
                                     mpih_axes_controller **controller);

// Ends a controller: frees what it holds, and itself unless it lies in memory of the caller. Nothing for NULL.
void mpih_axes_controller_free(mpih_axes_controller *controller);

// Takes the references, which come mpih_axes_controller_ahead samples early, and the measurements of now, and writes
// the drives to put out: a number for each axis.
//
// Drives are always finite, within their limits and no farther than the slew allows from the last ones. A reference
// that is not finite holds all drives; a measurement that is not finite moves no estimate. All are counted. Fails for
// NULL alone.
mpih_status mpih_axes_controller_step(mpih_axes_controller *controller,
                                      const double *references,
                                      const double *measurements,
                                      double *drives);

// mpih_axes_controller_step for `n` rows, one behind the other, bit for bit. Arrays may be the same.
mpih_status mpih_axes_controller_run(mpih_axes_controller *controller,
                                     const double *references,
                                     const double *measurements,
                                     double *drives,
                                     size_t n);

// The drives that mpih_axes_controller_step would write; nothing changes. Fails for NULL alone.
mpih_status mpih_axes_controller_peek(mpih_axes_controller *controller,
                                      const double *references,
                                      const double *measurements,
                                      double *drives);

// The drives for a sample that only mpih_axes_controller_commit takes: where writing to the amplifiers may fail. A
// plan replaces the one before; any change of the controller drops it. Fails for NULL alone.
mpih_status mpih_axes_controller_plan(mpih_axes_controller *controller,
                                      const double *references,
                                      const double *measurements,
                                      double *drives);

// Takes the sample that was planned; false if there is none.
bool mpih_axes_controller_commit(mpih_axes_controller *controller);

// The present drive of an axis: what its amplifier has. NaN for NULL, and if there is no such axis.
double mpih_axes_controller_drive(const mpih_axes_controller *controller, size_t axis);

// What comes in with a drive that is not of the model, as measurements tell. NaN for NULL, and if there is no such
// axis.
double mpih_axes_controller_disturbance(const mpih_axes_controller *controller, size_t axis);

// The lowest and the highest drive of an axis.
mpih_status mpih_axes_controller_limits(const mpih_axes_controller *controller, size_t axis, double *low, double *high);

// By how much a drive would have to change to move a position by one unit, once all has settled: the inverse of the
// static gain of the stage, so that all other positions stay. The controller of a drive sees the sum of these times
// the positions. NaN for NULL, and if there is no such drive or position.
double mpih_axes_controller_decoupling(const mpih_axes_controller *controller, size_t drive, size_t position);

// How many samples early references must come.
size_t mpih_axes_controller_ahead(const mpih_axes_controller *controller);

// For how many seconds at most, from the next sample on, a drive is not yet that of the law: the longest of all axes.
// NaN for NULL.
double mpih_axes_controller_lead_in(const mpih_axes_controller *controller);

// What the controller of an axis does with its samples. MPIH_MODE_HOLD for NULL, and if there is no such axis.
mpih_mode mpih_axes_controller_mode(const mpih_axes_controller *controller, size_t axis);

// Changes what the controllers of all axes do with their samples, from the next one on and without a jump: a number of
// mpih_mode, but for MPIH_MODE_STOP, which mpih_axes_controller_stop enters. Does not allocate unless it fails.
mpih_status mpih_axes_controller_set_mode(mpih_axes_controller *controller, int32_t mode);

// Which share of the disturbance the drive of an axis takes away, 0 to 1, from the next sample on and without a
// jump. It is 1 in a new controller. Does not allocate unless it fails.
mpih_status mpih_axes_controller_set_gain(mpih_axes_controller *controller, size_t axis, double kp);

// Holds all drives, from the next sample on. Neither allocates nor fails: it may be called in the loop.
void mpih_axes_controller_hold(mpih_axes_controller *controller);

// Ramps the `n` drives to their `rest_drives` at `rate` per second, or at the slew if that is slower, and holds them
// there, whatever references and measurements come. Go on calling step: every call writes the next drives of the ramp.
// Does not allocate unless it fails.
mpih_status mpih_axes_controller_stop(mpih_axes_controller *controller,
                                      double rate,
                                      const double *rest_drives,
                                      size_t n);

// Back from a hold or a stop to the mode before it. Neither allocates nor fails.
void mpih_axes_controller_release(mpih_axes_controller *controller);

// As made, but for the drives, which stay: the next motion starts from them. For the model it is as if they had come
// from rest one sample ago: mpih_axes_controller_follow tells it more. All counts are zero. Neither allocates nor
// fails.
void mpih_axes_controller_reset(mpih_axes_controller *controller);

// mpih_axes_controller_reset, the amplifiers being at `n` other drives now. If it fails the controller is as before.
mpih_status mpih_axes_controller_reset_at(mpih_axes_controller *controller, const double *drives, size_t n);

// Goes on from `n` other drives that the amplifiers have, with everything that is remembered. For the model they go
// out for one sample more: in a new controller, as if they had come from rest one sample ago.
// mpih_axes_controller_follow tells it more.
mpih_status mpih_axes_controller_start_at(mpih_axes_controller *controller, const double *drives, size_t n);

// Takes over what was driven before: `n` rows of drives, oldest first, one per sampling interval.
mpih_status mpih_axes_controller_follow(mpih_axes_controller *controller, const double *drives, size_t n);

// How many samples of an axis were unusual since the controller was made or reset. Does not allocate unless it fails.
mpih_status mpih_axes_controller_counters(const mpih_axes_controller *controller, size_t axis, mpih_counters *counters);

// Writes everything that the controller remembers to `text`, as mpih_forward_save does.
mpih_status mpih_axes_controller_save(const mpih_axes_controller *controller, char *text, size_t bytes, size_t *needed);

// Goes on, bit for bit, from what mpih_axes_controller_save wrote for a controller of the same stage, limits and
// options. The amplifiers must be at the drives of the state. If it fails the controller is as before.
mpih_status mpih_axes_controller_load(mpih_axes_controller *controller, const char *text);

// Reads a stage from the `n` bytes that mpih_stage_to_bytes wrote, or from those in a header that
// `mpi-hyst export --c` made. Other bytes are refused: MPIH_STATUS_FORMAT. Free the stage with mpih_stage_free.
mpih_status mpih_stage_from_bytes(const uint8_t *bytes, size_t n, mpih_stage **stage);

// Writes a stage to `bytes`, of which there are `n`, and how many that takes to `needed`. With NULL for `bytes` it
// only tells how many; `needed` may be NULL otherwise.
mpih_status mpih_stage_to_bytes(const mpih_stage *stage, uint8_t *bytes, size_t n, size_t *needed);

// mpih_forward_save in bytes, without a closing zero byte.
mpih_status mpih_forward_save_bytes(const mpih_forward *forward, uint8_t *bytes, size_t n, size_t *needed);

// mpih_forward_load from the `n` bytes that mpih_forward_save_bytes wrote.
mpih_status mpih_forward_load_bytes(mpih_forward *forward, const uint8_t *bytes, size_t n);

// mpih_inverse_save in bytes, without a closing zero byte.
mpih_status mpih_inverse_save_bytes(const mpih_inverse *inverse, uint8_t *bytes, size_t n, size_t *needed);

// mpih_inverse_load from the `n` bytes that mpih_inverse_save_bytes wrote.
mpih_status mpih_inverse_load_bytes(mpih_inverse *inverse, const uint8_t *bytes, size_t n);

// mpih_controller_save in bytes, without a closing zero byte.
mpih_status mpih_controller_save_bytes(const mpih_controller *controller, uint8_t *bytes, size_t n, size_t *needed);

// mpih_controller_load from the `n` bytes that mpih_controller_save_bytes wrote.
mpih_status mpih_controller_load_bytes(mpih_controller *controller, const uint8_t *bytes, size_t n);

// mpih_observer_save in bytes, without a closing zero byte.
mpih_status mpih_observer_save_bytes(const mpih_observer *observer, uint8_t *bytes, size_t n, size_t *needed);

// mpih_observer_load from the `n` bytes that mpih_observer_save_bytes wrote.
mpih_status mpih_observer_load_bytes(mpih_observer *observer, const uint8_t *bytes, size_t n);

// How many bytes mpih_controller_new needs.
size_t mpih_controller_size(void);

// Of which number the address of the memory for mpih_controller_new must be a multiple.
size_t mpih_controller_align(void);

// Makes a controller of a stage for a sampling interval of `dt` seconds, in `memory` of `bytes` bytes, or on the heap
// if `memory` is NULL. NULL for `options` stands for those of mpih_controller_options_default. The stage needs limits,
// or the options. End it with mpih_controller_free.
mpih_status mpih_controller_new(const mpih_stage *stage,
                                double dt,
                                const mpih_controller_options *options,
                                void *memory,
                                size_t bytes,
                                mpih_controller **controller);

// Ends a controller: frees what it holds, and itself unless it lies in memory of the caller. Nothing for NULL.
void mpih_controller_free(mpih_controller *controller);

// Takes the reference and the measurement of now and returns the drive to put out.
//
// The drive is always finite, within the limits and no farther than the slew allows from the last one. The first drive
// is that of the start. A reference that is not finite holds the drive, a measurement that is not finite or cannot be
// does so for a few samples; all are counted. NaN for NULL: there is no last drive that could be held.
double mpih_controller_step(mpih_controller *controller, double reference, double measurement);

// mpih_controller_step with a drive that takes the place of the feed-forward for this sample: always with
// MPIH_FEEDFORWARD_GIVEN. A drive that is not finite holds the last one and is counted. NaN for NULL.
double mpih_controller_step_given(mpih_controller *controller,
                                  double reference,
                                  double feedforward,
                                  double measurement);

// The drive that mpih_controller_step would return; nothing changes. NaN for NULL.
double mpih_controller_peek(const mpih_controller *controller, double reference, double measurement);

// The drive that mpih_controller_step_given would return; nothing changes. NaN for NULL.
double mpih_controller_peek_given(const mpih_controller *controller,
                                  double reference,
                                  double feedforward,
                                  double measurement);

// The drive for a sample that only mpih_controller_commit takes: where writing to the amplifier may fail. A plan
// replaces the one before; any change of the controller drops it. NaN for NULL.
double mpih_controller_plan(mpih_controller *controller, double reference, double measurement);

// mpih_controller_plan with a drive that takes the place of the feed-forward. NaN for NULL.
double mpih_controller_plan_given(mpih_controller *controller,
                                  double reference,
                                  double feedforward,
                                  double measurement);

// Takes the sample that was planned; false if there is none.
bool mpih_controller_commit(mpih_controller *controller);

// mpih_controller_step for `n` rows, bit for bit. Arrays may be the same.
mpih_status mpih_controller_run(mpih_controller *controller,
                                const double *references,
                                const double *measurements,
                                double *drives,
                                size_t n);

// mpih_controller_step_given for `n` rows, bit for bit. Arrays may be the same.
mpih_status mpih_controller_run_given(mpih_controller *controller,
                                      const double *references,
                                      const double *feedforwards,
                                      const double *measurements,
                                      double *drives,
                                      size_t n);

// The present drive: what the amplifier has. NaN for NULL.
double mpih_controller_drive(const mpih_controller *controller);

// How many samples early references must come, smoothing included; 0 without MPIH_FEEDFORWARD_PREVIEW.
size_t mpih_controller_ahead(const mpih_controller *controller);

// For how many seconds at most, from the next sample on, the drive is not yet that of the law. NaN for NULL.
double mpih_controller_lead_in(const mpih_controller *controller);

// The gains, given or tuned, in V/um and V/um/s.
mpih_status mpih_controller_gains(const mpih_controller *controller, double *kp, double *ki);

// The lowest and the highest drive.
mpih_status mpih_controller_limits(const mpih_controller *controller, double *low, double *high);

// What the controller does with its samples; MPIH_MODE_HOLD for NULL.
mpih_mode mpih_controller_mode(const mpih_controller *controller);

// Changes what the controller does with its samples, from the next one on and without a jump: a number of mpih_mode,
// but for MPIH_MODE_STOP, which mpih_controller_stop enters.
mpih_status mpih_controller_set_mode(mpih_controller *controller, int32_t mode);

// Holds the drive, from the next sample on. Neither allocates nor fails: it may be called in the loop.
void mpih_controller_hold(mpih_controller *controller);

// Ramps the drive to `rest_drive` at `rate` per second, or at the slew if that is slower, and holds it there, whatever
// reference and measurement come. Go on calling step: every call returns the next drive of the ramp. Does not allocate
// unless it fails.
mpih_status mpih_controller_stop(mpih_controller *controller, double rate, double rest_drive);

// Back from a hold or a stop to the mode before it. Neither allocates nor fails.
void mpih_controller_release(mpih_controller *controller);

// Changes the gains, in V/um and V/um/s, without a jump. Filters stay. Does not allocate unless it fails.
mpih_status mpih_controller_set_gains(mpih_controller *controller, double kp, double ki);

// As made, but for gains that were changed since and for the drive, which stays: the next motion starts from it. All
// counts are zero. Neither allocates nor fails.
void mpih_controller_reset(mpih_controller *controller);

// mpih_controller_reset, the amplifier being at another drive now.
mpih_status mpih_controller_reset_at(mpih_controller *controller, double drive);

// Goes on from another drive that the amplifier has, with everything that is remembered: after mpih_controller_load,
// if the amplifier is not where it was.
mpih_status mpih_controller_start_at(mpih_controller *controller, double drive);

// Takes over what was driven before, oldest drive first, one per sampling interval. The next motion starts from the
// last of the drives.
mpih_status mpih_controller_follow(mpih_controller *controller, const double *drives, size_t n);

// Writes everything that the controller remembers to `text`, as mpih_forward_save does.
mpih_status mpih_controller_save(const mpih_controller *controller, char *text, size_t bytes, size_t *needed);

// Goes on, bit for bit, from what mpih_controller_save wrote for a controller of the same stage, sampling interval,
// limits and gains. The amplifier must be at the drive of the state. If it fails the controller is as before.
mpih_status mpih_controller_load(mpih_controller *controller, const char *text);

// Leaves every option open (NaN, -1): the stage decides when the controller is made. The feed-forward is the exact
// inverse of the reference of now.
mpih_status mpih_controller_options_default(mpih_controller_options *options);

// The terms of the last sample. Does not allocate.
mpih_status mpih_controller_terms(const mpih_controller *controller, mpih_terms *terms);

// How many samples were unusual since the controller was made or reset. Does not allocate.
mpih_status mpih_controller_counters(const mpih_controller *controller, mpih_counters *counters);

// How many bytes mpih_forward_new needs.
size_t mpih_forward_size(void);

// Of which number the address of the memory for mpih_forward_new must be a multiple.
size_t mpih_forward_align(void);

// Makes a forward model at rest for a sampling interval of `dt` seconds, in `memory` of `bytes` bytes, or on the heap
// if `memory` is NULL. End it with mpih_forward_free.
mpih_status mpih_forward_new(const mpih_stage *stage, double dt, void *memory, size_t bytes, mpih_forward **forward);

// Ends a forward model: frees what it holds, and itself unless it lies in memory of the caller. Nothing for NULL.
void mpih_forward_free(mpih_forward *forward);

// A row of a record: puts out a drive and returns the position at this moment, t_k. The drive is then held until
// t_(k+1).
//
// A drive beyond the limits of the stage is clamped and counted. One that is not finite leaves the position as it is
// and is counted. NaN for NULL.
double mpih_forward_step(mpih_forward *forward, double drive);

// A plant in a loop: holds a drive for one sampling interval and returns the position at its end, just before the next
// drive. That is what a controller reads next. Bad drives are as for mpih_forward_step. NaN for NULL.
double mpih_forward_advance(mpih_forward *forward, double drive);

// The position that mpih_forward_step would return; nothing changes. NaN for NULL.
double mpih_forward_peek(const mpih_forward *forward, double drive);

// mpih_forward_step for `n` drives, bit for bit. Both arrays may be the same.
mpih_status mpih_forward_run(mpih_forward *forward, const double *drives, double *positions, size_t n);

// The last position. NaN for NULL.
double mpih_forward_position(const mpih_forward *forward);

// How many drives were not finite (or beyond 1e100).
uint64_t mpih_forward_rejected(const mpih_forward *forward);

// How many drives lay beyond the limits of the stage and were clamped.
uint64_t mpih_forward_clamped(const mpih_forward *forward);

// At rest since forever at a drive: creep and modes at their ends, the hysteresis virgin but for the way there.
// Returns the position. NaN for NULL.
double mpih_forward_settle(mpih_forward *forward, double drive);

// As made: at rest at the rest drive of the stage, all counts zero.
void mpih_forward_reset(mpih_forward *forward);

// Takes over what was driven before, oldest drive first, one per sampling interval.
mpih_status mpih_forward_follow(mpih_forward *forward, const double *drives, size_t n);

// Writes everything that the model remembers to `text`, as JSON with a closing zero byte, and the bytes that this
// takes to `needed`. With NULL for `text` it only tells how many; `needed` may be NULL otherwise. Allocates.
mpih_status mpih_forward_save(const mpih_forward *forward, char *text, size_t bytes, size_t *needed);

// Goes on, bit for bit, from what mpih_forward_save wrote for a model of the same stage and sampling interval. If it
// fails the model is as before.
mpih_status mpih_forward_load(mpih_forward *forward, const char *text);

// How many bytes mpih_inverse_new needs.
size_t mpih_inverse_size(void);

// Of which number the address of the memory for mpih_inverse_new must be a multiple.
size_t mpih_inverse_align(void);

// Makes an inverse at rest for a sampling interval of `dt` seconds and drives from `limit_low` to `limit_high`, in
// `memory` of `bytes` bytes, or on the heap if `memory` is NULL. Limits that are both NaN are those of the stage. End
// it with mpih_inverse_free.
mpih_status mpih_inverse_new(const mpih_stage *stage,
                             double dt,
                             double limit_low,
                             double limit_high,
                             void *memory,
                             size_t bytes,
                             mpih_inverse **inverse);

// Ends an inverse: frees what it holds, and itself unless it lies in memory of the caller. Nothing for NULL.
void mpih_inverse_free(mpih_inverse *inverse);

// The drive for a target. A target out of reach puts the drive at a limit. One that is not finite leaves the drive as
// it is and is counted. NaN for NULL.
double mpih_inverse_step(mpih_inverse *inverse, double target);

// The drive that mpih_inverse_step would return; nothing changes. NaN for NULL.
double mpih_inverse_peek(const mpih_inverse *inverse, double target);

// mpih_inverse_step for `n` targets, bit for bit. Both arrays may be the same.
mpih_status mpih_inverse_run(mpih_inverse *inverse, const double *targets, double *drives, size_t n);

// The last drive. NaN for NULL.
double mpih_inverse_drive(const mpih_inverse *inverse);

// The position that the stage has at the last drive, if it is as the model says. NaN for NULL.
double mpih_inverse_position(const mpih_inverse *inverse);

// Whether the last target was out of reach and the drive is at a limit.
bool mpih_inverse_saturated(const mpih_inverse *inverse);

// How many targets were not finite (or beyond 1e100).
uint64_t mpih_inverse_rejected(const mpih_inverse *inverse);

// Puts out another drive than one that a target asks for, and remembers it: where something else drives for a while.
// It is kept within the limits; one that is not finite is counted and changes nothing else. Returns the drive. NaN for
// NULL.
double mpih_inverse_follow_drive(mpih_inverse *inverse, double drive);

// At rest since forever at a drive: the creep at its end, the hysteresis virgin but for the way there. Returns the
// position. NaN for NULL.
double mpih_inverse_settle(mpih_inverse *inverse, double drive);

// As made: at rest at 0 or the limit nearest to it, all counts zero.
void mpih_inverse_reset(mpih_inverse *inverse);

// Takes over what was driven before, oldest drive first, one per sampling interval.
mpih_status mpih_inverse_follow(mpih_inverse *inverse, const double *drives, size_t n);

// Writes everything that the inverse remembers to `text`, as mpih_forward_save does.
mpih_status mpih_inverse_save(const mpih_inverse *inverse, char *text, size_t bytes, size_t *needed);

// Goes on, bit for bit, from what mpih_inverse_save wrote for an inverse of the same stage, sampling interval and
// limits. If it fails the inverse is as before.
mpih_status mpih_inverse_load(mpih_inverse *inverse, const char *text);

// How many bytes mpih_observer_new needs.
size_t mpih_observer_size(void);

// Of which number the address of the memory for mpih_observer_new must be a multiple.
size_t mpih_observer_align(void);

// Makes an observer at rest for a sampling interval of `dt` seconds, in `memory` of `bytes` bytes, or on the heap if
// `memory` is NULL. End it with mpih_observer_free.
//
// `drift`: by how much what the model does not know changes in one second, rms, in the unit of the position. `noise`:
// the rms noise of the measurement; NaN for that of the stage.
mpih_status mpih_observer_new(const mpih_stage *stage,
                              double dt,
                              double drift,
                              double noise,
                              void *memory,
                              size_t bytes,
                              mpih_observer **observer);

// Ends an observer: frees what it holds, and itself unless it lies in memory of the caller. Nothing for NULL.
void mpih_observer_free(mpih_observer *observer);

// Takes the drive that was held since the last sample and the measurement of now, read just before the next drive is
// put out; returns the position of now.
//
// Without a finite measurement the model goes on alone, without a finite drive it stays at the last one; either is
// counted. NaN for NULL.
double mpih_observer_step(mpih_observer *observer, double drive, double measurement);

// mpih_observer_step for `n` rows, bit for bit. Arrays may be the same.
mpih_status mpih_observer_run(mpih_observer *observer,
                              const double *drives,
                              const double *measurements,
                              double *positions,
                              size_t n);

// What the model does not know, at the input of the modes, in the unit of the position. NaN for NULL.
double mpih_observer_disturbance(const mpih_observer *observer);

// How many drives or measurements were not finite.
uint64_t mpih_observer_rejected(const mpih_observer *observer);

// As made: at rest at the rest drive of the stage, all counts zero.
void mpih_observer_reset(mpih_observer *observer);

// Takes over what was driven before, oldest drive first, one per sampling interval, without measurements.
mpih_status mpih_observer_follow(mpih_observer *observer, const double *drives, size_t n);

// Writes everything that the observer remembers to `text`, as mpih_forward_save does.
mpih_status mpih_observer_save(const mpih_observer *observer, char *text, size_t bytes, size_t *needed);

// Goes on, bit for bit, from what mpih_observer_save wrote for an observer of the same stage, sampling interval, noise
// and drift. If it fails the observer is as before.
mpih_status mpih_observer_load(mpih_observer *observer, const char *text);

// Reads an oscillator from the text of its file. `text` is UTF-8 and ends with a zero byte. Free it with
// mpih_oscillator_free.
mpih_status mpih_oscillator_from_json(const char *text, mpih_oscillator **oscillator);

// Reads the file of an oscillator. `path` is UTF-8 and ends with a zero byte. Free it with mpih_oscillator_free.
mpih_status mpih_oscillator_from_file(const char *path, mpih_oscillator **oscillator);

// Frees an oscillator; nothing for NULL.
void mpih_oscillator_free(mpih_oscillator *oscillator);

// How many bytes mpih_oscillator_forward_new needs.
size_t mpih_oscillator_forward_size(void);

// Of which number the address of the memory for mpih_oscillator_forward_new must be a multiple.
size_t mpih_oscillator_forward_align(void);

// Makes a forward model of an oscillator at rest for a sampling interval of `dt` seconds, integrated in so many
// sub-steps, or in as many as the oscillator needs for 0; in `memory` of `bytes` bytes, or on the heap if `memory` is
// NULL. End it with mpih_oscillator_forward_free.
mpih_status mpih_oscillator_forward_new(const mpih_oscillator *oscillator,
                                        double dt,
                                        size_t sub_steps,
                                        void *memory,
                                        size_t bytes,
                                        mpih_oscillator_forward **forward);

// Ends a forward model: frees what it holds, and itself unless it lies in memory of the caller. Nothing for NULL.
void mpih_oscillator_forward_free(mpih_oscillator_forward *forward);

// A row of a record: returns the position at this moment, t_k, then holds the drive until t_(k+1).
//
// A drive that is not finite counts as the last one. One that would bring the motion beyond 1e100 changes nothing.
// Both are counted. NaN for NULL.
double mpih_oscillator_forward_step(mpih_oscillator_forward *forward, double drive);

// A plant in a loop: holds a drive for one sampling interval and returns the position at its end. Bad drives are as
// for mpih_oscillator_forward_step. NaN for NULL.
double mpih_oscillator_forward_advance(mpih_oscillator_forward *forward, double drive);

// mpih_oscillator_forward_step for `n` drives, bit for bit. Both arrays may be the same.
mpih_status mpih_oscillator_forward_run(mpih_oscillator_forward *forward,
                                        const double *drives,
                                        double *positions,
                                        size_t n);

// The position of now. NaN for NULL.
double mpih_oscillator_forward_position(const mpih_oscillator_forward *forward);

// How many drives were not finite, or would have brought the motion beyond 1e100.
uint64_t mpih_oscillator_forward_rejected(const mpih_oscillator_forward *forward);

// Back to rest, all counts zero.
void mpih_oscillator_forward_reset(mpih_oscillator_forward *forward);

// Writes everything that the model remembers to `text`, as mpih_forward_save does.
mpih_status mpih_oscillator_forward_save(const mpih_oscillator_forward *forward,
                                         char *text,
                                         size_t bytes,
                                         size_t *needed);

// Goes on, bit for bit, from what mpih_oscillator_forward_save wrote for a model of the same oscillator. If it fails
// the model is as before.
mpih_status mpih_oscillator_forward_load(mpih_oscillator_forward *forward, const char *text);

// Reads a stage from the text of a stage file, or from that of a model file: a stage of that hysteresis alone. `text`
// is UTF-8 and ends with a zero byte. Free the stage with mpih_stage_free.
mpih_status mpih_stage_from_json(const char *text, mpih_stage **stage);

// Reads a stage file, or a model file. `path` is UTF-8 and ends with a zero byte. Free the stage with mpih_stage_free.
mpih_status mpih_stage_from_file(const char *path, mpih_stage **stage);

// Frees a stage; nothing for NULL.
void mpih_stage_free(mpih_stage *stage);

// What a stage says of itself.
mpih_status mpih_stage_properties(const mpih_stage *stage, mpih_properties *properties);

// The unit of drives, such as "V": valid as long as the stage. NULL for NULL.
const char *mpih_stage_drive_unit(const mpih_stage *stage);

// The unit of positions, such as "um": valid as long as the stage. NULL for NULL.
const char *mpih_stage_position_unit(const mpih_stage *stage);

// How many warnings identification left in the stage file. Look at them before the stage drives anything.
size_t mpih_stage_warning_count(const mpih_stage *stage);

// A warning as one line, "severity: code: message: what to try": valid as long as the stage. The severity is "amber",
// or "red" where the stage is not to be used. NULL if there are not so many, and for NULL.
const char *mpih_stage_warning(const mpih_stage *stage, size_t index);

// The message about the last call of this thread that failed: the argument, what was expected, what came. Empty if
// none failed. It is valid until the next call of this thread that fails; do not free it.
const char *mpih_last_error(void);

// The name of a status, such as "MPIH_STATUS_OK"; "unknown status" for any other number.
const char *mpih_status_name(int32_t status);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* MPI_HYST_H */
