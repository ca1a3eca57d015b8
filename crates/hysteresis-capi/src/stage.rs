//! The stage: read from its file, and what it says of itself.

use core::ffi::c_char;
use core::mem::MaybeUninit;
use std::ffi::CString;

use hysteresis_control::stage;

use crate::boundary::{Failure, Status, free, guard, hand_over, read, read_file, tell, there};

/// A stage: what a stage file says of an actuator. It never changes, so several threads may use it at once. What is
/// made from it keeps what it needs: the stage may be freed before.
pub struct Stage {
    pub(crate) inner: stage::Stage,
    drive_unit: CString,
    position_unit: CString,
    warnings: Vec<CString>,
}

/// What a stage says of itself. A number that the stage does not state is NaN. Drives and positions are in the units of
/// the stage (V and um by default), times in seconds.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Properties {
    /// The lowest drive that the hardware takes.
    pub limit_low: f64,
    /// The highest drive that the hardware takes.
    pub limit_high: f64,
    /// The lowest drive of what is made from the stage, unless told: the limit, or the lowest drive that was
    /// identified.
    pub drive_low: f64,
    /// The highest drive of what is made from the stage, unless told.
    pub drive_high: f64,
    /// The lowest position that the stage reaches between these drives whatever happened before: the end of its slow
    /// loop.
    pub position_low: f64,
    /// The highest position that it reaches in the same sense.
    pub position_high: f64,
    /// The drive at rest: 0, or the limit nearest to it.
    pub rest_drive: f64,
    /// What the sensor shows later than hysteresis and modes explain.
    pub dead_time: f64,
    /// How fast the drive may change, per second.
    pub slew: f64,
    /// The rms noise of the sensor.
    pub noise: f64,
    /// The lowest slope of the position over the drive.
    pub slope_low: f64,
    /// The highest slope of the position over the drive.
    pub slope_high: f64,
    /// For how long a reference must be smoothed so that its steps leave lightly damped modes at rest; 0 without such
    /// modes.
    pub smoothing: f64,
}

fn string(name: &str, text: &str) -> Result<CString, Failure> {
    CString::new(text).map_err(|_| Failure::new(Status::Format, format!("{name}: expected text without a zero byte")))
}

impl Stage {
    fn from_json(text: &str) -> Result<Self, Failure> {
        Self::of(stage::Stage::from_json(text)?)
    }

    /// A stage with its texts as C reads them.
    pub(crate) fn of(stage: stage::Stage) -> Result<Self, Failure> {
        let parts = stage.parts();
        let warnings = parts.identified.iter().flat_map(|identified| &identified.warnings);
        let warnings = warnings
            .map(|warning| {
                let stage::StageWarning { severity, code, message, hint, .. } = warning;
                string("warnings", &format!("{severity}: {code}: {message}: {hint}"))
            })
            .collect::<Result<_, _>>()?;
        let drive_unit = string("units.drive", &parts.units.drive)?;
        let position_unit = string("units.position", &parts.units.position)?;
        Ok(Self { inner: stage, drive_unit, position_unit, warnings })
    }
}

/// Reads a stage from the text of a stage file, or from that of a model file: a stage of that hysteresis alone. `text`
/// is UTF-8 and ends with a zero byte. Free the stage with mpih_stage_free.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_stage_from_json(text: *const c_char, stage: *mut *mut Stage) -> Status {
    // SAFETY: as the header asks of the caller.
    unsafe { hand_over("stage", stage, || Stage::from_json(read("text", text)?)) }
}

/// Reads a stage file, or a model file. `path` is UTF-8 and ends with a zero byte. Free the stage with mpih_stage_free.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_stage_from_file(path: *const c_char, stage: *mut *mut Stage) -> Status {
    // SAFETY: as the header asks of the caller.
    unsafe { hand_over("stage", stage, || Stage::from_json(&read_file(path)?)) }
}

/// Frees a stage; nothing for NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_stage_free(stage: *mut Stage) {
    // SAFETY: as the header asks of the caller.
    unsafe { free(stage) }
}

/// What a stage says of itself.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_stage_properties(
    stage: Option<&Stage>,
    properties: Option<&mut MaybeUninit<Properties>>,
) -> Status {
    guard(|| {
        let stage = &there("stage", stage)?.inner;
        let parts = stage.parts();
        let unknown = (f64::NAN, f64::NAN);
        let (limit_low, limit_high) = parts.limits.unwrap_or(unknown);
        let (drive_low, drive_high) = stage.drive_range().unwrap_or(unknown);
        let (position_low, position_high) = stage.position_range().unwrap_or(unknown);
        let (slope_low, slope_high) = stage.slope_range();
        let made = Properties {
            limit_low,
            limit_high,
            drive_low,
            drive_high,
            position_low,
            position_high,
            rest_drive: stage.rest_drive(),
            dead_time: parts.dead_time,
            slew: parts.slew.unwrap_or(f64::NAN),
            noise: parts.noise.unwrap_or(f64::NAN),
            slope_low,
            slope_high,
            smoothing: stage.smoothing(),
        };
        tell("properties", properties, made)
    })
}

/// The unit of drives, such as "V": valid as long as the stage. NULL for NULL.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_stage_drive_unit(stage: Option<&Stage>) -> *const c_char {
    stage.map_or(core::ptr::null(), |stage| stage.drive_unit.as_ptr())
}

/// The unit of positions, such as "um": valid as long as the stage. NULL for NULL.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_stage_position_unit(stage: Option<&Stage>) -> *const c_char {
    stage.map_or(core::ptr::null(), |stage| stage.position_unit.as_ptr())
}

/// How many warnings identification left in the stage file. Look at them before the stage drives anything.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_stage_warning_count(stage: Option<&Stage>) -> usize {
    stage.map_or(0, |stage| stage.warnings.len())
}

/// A warning as one line, "severity: code: message: what to try": valid as long as the stage. The severity is "amber",
/// or "red" where the stage is not to be used. NULL if there are not so many, and for NULL.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_stage_warning(stage: Option<&Stage>, index: usize) -> *const c_char {
    stage.and_then(|stage| stage.warnings.get(index)).map_or(core::ptr::null(), |warning| warning.as_ptr())
}
