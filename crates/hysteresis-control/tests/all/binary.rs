//! Stages and states as bytes: bit for bit there and back, and nothing but an error for other bytes.

use hysteresis_control::binary::{Binary, Sampled};
use hysteresis_control::linear::{Antiresonance, Creep, FirstOrder, LinearDynamics, Modes, SecondOrder, StateSpace};
use hysteresis_control::stage::{
    CELLS, ErrorBand, FeedForwardKind, Identified, LoopShift, RecordSource, RelaxingPlays, SlowGain, Stage, StageParts,
    StageWarning, TemperatureTerm, Units,
};
use hysteresis_control::{Observer, ObserverOptions, StageController, StageControllerState};
use hysteresis_core::{
    Biquad, ControllerOptions, ControllerState, Duhem, MAX_KNOTS, ModifiedPrandtlIshlinskii, Offsets,
    PiecewiseLinearMap, Process, Ratios, Sections,
};
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;

const DT: f64 = 1e-4;

fn identified(numbers: [f64; 3]) -> Identified {
    let [rmse, max_error, value] = numbers;
    Identified {
        drive_range: (-1.5, 2.5),
        position_range: (0.25, 1.0 / 3.0),
        dt: vec![DT],
        rmse,
        max_error,
        parameters: vec!["w[0]".into(), "µ".into()],
        covariance: vec![vec![value, 1e-300], vec![f64::INFINITY, -0.0]],
        warnings: vec![StageWarning {
            code: "drift".into(),
            severity: "red".into(),
            message: "it drifts".into(),
            value,
            limit: f64::NEG_INFINITY,
            hint: String::new(),
        }],
        records: vec![RecordSource { name: "a.csv".into(), sha256: Some("00ff".into()) }],
    }
}

fn error_band() -> ErrorBand {
    let errors = vec![vec![0.25; CELLS]; CELLS];
    ErrorBand::new(0.003, (-1.5, 2.5), 0.1, errors, vec![(300.0, 1.5)], vec![(0.1, 1.0), (10.0, 2.0)]).unwrap()
}

fn temperature() -> TemperatureTerm {
    TemperatureTerm::new(0.02, 60.0, 25.0).unwrap()
}

fn every_section() -> LinearDynamics {
    let mode = |frequency| SecondOrder::new(frequency, 0.1).unwrap();
    let pair = Antiresonance::new(mode(700.0), mode(900.0));
    let modes = Modes::new(&[0.75, 0.25], &[mode(800.0), mode(1900.0)]).unwrap();
    let space = StateSpace::new(
        DMatrix::from_row_slice(2, 2, &[-50.0, 1.0, 0.0, -60.0]),
        DVector::from_vec(vec![0.0, 3000.0]),
        DVector::from_vec(vec![1.0, 0.0]),
        0.0,
    )
    .unwrap();
    LinearDynamics::from(FirstOrder::new(300.0).unwrap()).then(mode(500.0)).then(pair).then(modes).then(space)
}

prop_compose! {
    fn hysteresis()(n in 1_usize..6)(
        weights in prop::collection::vec(1e-3..1.0, n),
        below in prop::option::of(prop::collection::vec(1e-3..1.0, n)),
        steps in prop::collection::vec(0.1..10.0_f64, n),
        offsets in (-2.0..2.0, -2.0..2.0),
    ) -> ModifiedPrandtlIshlinskii {
        let r: Vec<f64> = steps.iter().scan(-steps[0], |r, step| { *r += step; Some(*r) }).collect();
        let offsets = Offsets { input: offsets.0, output: offsets.1 };
        let model = ModifiedPrandtlIshlinskii::from_ratios(&weights, &r, Ratios::PAPER, offsets).unwrap();
        match below {
            Some(below) => model.with_negative_weights(&below).unwrap(),
            None => model,
        }
    }
}

fn any_number() -> impl Strategy<Value = f64> {
    prop_oneof![1e-9..1e3, Just(f64::NAN), Just(f64::INFINITY), Just(-0.0)]
}

prop_compose! {
    fn stages()(
        hysteresis in hysteresis(),
        maps in prop::array::uniform2(prop::option::of(0.5..2.0)),
        amplifier in prop::option::of(100.0..5000.0),
        (shift, gain, band, warm) in any::<(bool, bool, bool, bool)>(),
        duhem in prop::option::of(prop::sample::select(vec![1.0, -1.0])),
        creep in prop::option::of(1_u16..5),
        order in any::<bool>(),
        (dead_time, slew, noise) in (0.0..1e-2, prop::option::of(1.0..1e6), prop::option::of(0.0..1.0)),
        limits in prop::option::of((-100.0..0.0, 1.0..200.0)),
        known in prop::option::of(prop::array::uniform3(any_number())),
    ) -> Stage {
        let [input_map, output_map] =
            maps.map(|map| map.map(|y: f64| PiecewiseLinearMap::new(&[-1.0, 0.0, 3.0], &[-y, 0.0, 3.1]).unwrap()));
        Stage::new(StageParts {
            input_map,
            output_map,
            amplifier: amplifier.map(|bandwidth| FirstOrder::new(bandwidth).unwrap()),
            loop_shift: shift.then(|| LoopShift::new(60.0, 90.0, [-0.2, 0.1], 0.02, 0.5).unwrap()),
            relaxing_plays: gain.then(relaxing_plays),
            slow_gain: gain.then(|| SlowGain::new(90.0, -0.02, 10.0, 30.0).unwrap()),
            creep: creep.map(|terms| Creep::logarithmic(0.012, 0.01, 100.0, terms).unwrap()),
            dynamics: if order { every_section() } else { LinearDynamics::none() },
            dead_time,
            limits,
            slew,
            noise,
            error_band: band.then(error_band),
            duhem: duhem.map(bouc_wen),
            temperature: warm.then(temperature),
            identified: known.map(identified),
            units: Units { drive: "V".into(), position: "µm".into() },
            ..StageParts::new(hysteresis)
        }).unwrap()
    }
}

/// One that adds, or with the sign -1 one that is subtracted.
fn bouc_wen(sign: f64) -> Box<Duhem<MAX_KNOTS>> {
    Box::new(Duhem::from_bouc_wen(sign * 0.02, 0.5, 0.9, sign * 0.4).unwrap())
}

fn relaxing_plays() -> RelaxingPlays {
    RelaxingPlays::new(&[0.0, 9.0], 60.0, &[0.01, 0.3], &[vec![0.01, 0.02], vec![0.0, 0.03]]).unwrap()
}

/// A stage with everything that leaves a memory.
fn stage() -> Stage {
    let model = ModifiedPrandtlIshlinskii::from_ratios(
        &[0.1, 0.02, 0.03],
        &[0.0, 7.0, 20.0],
        Ratios::PAPER,
        Offsets::default(),
    );
    Stage::new(StageParts {
        creep: Some(Creep::logarithmic(0.012, 0.01, 100.0, 4).unwrap()),
        dynamics: SecondOrder::new(800.0, 0.1).unwrap().into(),
        loop_shift: Some(LoopShift::new(60.0, 90.0, [-0.2, 0.1], 0.02, 0.5).unwrap()),
        relaxing_plays: Some(relaxing_plays()),
        slow_gain: Some(SlowGain::new(90.0, -0.02, 10.0, 30.0).unwrap()),
        amplifier: Some(FirstOrder::new(2000.0).unwrap()),
        dead_time: 2.5 * DT,
        limits: Some((-30.0, 150.0)),
        noise: Some(1e-3),
        ..StageParts::new(model.unwrap())
    })
    .unwrap()
}

/// That stage without a Duhem operator, with one that adds, and with one that is subtracted.
fn stages_with_memory() -> [Stage; 3] {
    let with = |sign| Stage::new(StageParts { duhem: Some(bouc_wen(sign)), ..stage().parts().clone() }).unwrap();
    [stage(), with(1.0), with(-1.0)]
}

fn controllers() -> Vec<StageController> {
    stages_with_memory().iter().flat_map(controllers_of).collect()
}

fn controllers_of(stage: &Stage) -> [StageController; 3] {
    let options = ControllerOptions { slew: Some(1e5), ..ControllerOptions::new(1.0, 50.0, DT, (-30.0, 150.0)) };
    let half = Biquad::new([0.5, 0.5, 0.0], [0.0, 0.0]).unwrap();
    let filtered = ControllerOptions { filters: Sections::new(&[half]).unwrap(), ..options };
    let preview = FeedForwardKind::Preview { ahead: 12, smoothing: 0.0 };
    let kinds = [(FeedForwardKind::Inverse, filtered), (preview, options), (FeedForwardKind::Given, options)];
    kinds.map(|(kind, options)| stage.controller(kind, &options).unwrap().into())
}

#[test]
fn a_file_leaves_out_parts_that_a_stage_does_not_have() {
    let names = ["slow_gain", "loop_shift", "error_band", "duhem", "temperature"];
    let whole = StageParts {
        error_band: Some(error_band()),
        duhem: Some(bouc_wen(1.0)),
        temperature: Some(temperature()),
        ..stage().parts().clone()
    };
    let whole = Stage::new(whole).unwrap().to_json();
    let none = Stage::new(StageParts::new(stage().parts().hysteresis.clone())).unwrap().to_json();
    for name in names {
        assert!(whole.contains(name) && !none.contains(name), "{name}");
    }
}

#[test]
fn a_content_that_is_cut_off_is_refused() {
    let bytes = stage().to_bytes();
    let content = &bytes[14..bytes.len() - 4];
    for length in 0..content.len() {
        let error = Stage::from_bytes(&sealed(1, &content[..length])).unwrap_err();
        assert_eq!(error.parameter(), Some("bytes"), "{length}: {error}");
    }
}

proptest! {
    #[test]
    fn a_stage_comes_back_bit_for_bit(stage in stages()) {
        let bytes = stage.to_bytes();
        let back = Stage::from_bytes(&bytes).unwrap();
        // A NaN is not equal to itself, its bytes are.
        prop_assert_eq!(back.to_bytes(), bytes);
        prop_assert_eq!(&back, &stage);
        prop_assert_eq!(back.to_json(), stage.to_json());
    }

    #[test]
    fn a_changed_byte_is_noticed(place in any::<prop::sample::Index>(), change in 1_u8..) {
        let mut bytes = stage().to_bytes();
        let place = place.index(bytes.len());
        bytes[place] ^= change;
        let error = Stage::from_bytes(&bytes).unwrap_err();
        prop_assert_eq!(error.parameter(), Some("bytes"), "{}", error);
    }

    /// Behind a checksum that is right, so that the content is read.
    #[test]
    fn any_content_is_a_value_or_an_error(content in prop::collection::vec(any::<u8>(), 0..400), kind in 1_u8..9) {
        read_all(&sealed(kind, &content));
        read_all(&content);
    }

    #[test]
    fn a_content_with_changes_is_a_value_or_an_error(
        which in 0_usize..6,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
    ) {
        let mut bytes = samples().swap_remove(which);
        let kind = bytes[8];
        let content = 14..bytes.len() - 4;
        for (place, byte) in changes {
            let place = content.start + place.index(content.len());
            bytes[place] = byte;
        }
        read_all(&sealed(kind, &bytes[content]));
    }
}

/// Bytes with a header and a checksum as they should be, written apart from the code under test.
fn sealed(kind: u8, content: &[u8]) -> Vec<u8> {
    let length = u32::try_from(content.len()).unwrap().to_le_bytes();
    let mut bytes = [b"mpi_hyst".as_slice(), &[kind, 2], &length, content].concat();
    let mut crc = u32::MAX;
    for byte in &bytes {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            crc = if crc & 1 == 1 { crc >> 1 ^ 0xEDB8_8320 } else { crc >> 1 };
        }
    }
    bytes.extend_from_slice(&(!crc).to_le_bytes());
    bytes
}

fn read_all(bytes: &[u8]) {
    let _ = Stage::from_bytes(bytes);
    let _ = ControllerState::from_bytes(bytes);
    let _ = StageControllerState::from_bytes(bytes);
    let _ = hysteresis_control::ObserverState::from_bytes(bytes);
    let _ = Sampled::<hysteresis_control::stage::StageState>::from_bytes(bytes);
    let _ = Sampled::<hysteresis_core::QuasiStaticState>::from_bytes(bytes);
}

/// One of each kind.
fn samples() -> Vec<Vec<u8>> {
    let stage = stage();
    let (mut forward, mut inverse) = (stage.forward(DT).unwrap(), stage.inverse(DT, None).unwrap());
    let mut observer = Observer::new(&stage, DT, &ObserverOptions { noise: 1e-3, drift: 0.5 }).unwrap();
    let mut controller = controllers().swap_remove(0);
    for drive in [20.0, -5.0, 80.0, f64::NAN, 30.0] {
        forward.step(drive);
        inverse.step(0.1 * drive);
        observer.step(drive, 1.0);
        controller.step((0.1 * drive).into(), 2.0);
    }
    vec![
        stage.to_bytes(),
        Sampled { dt: DT, stream: forward.state() }.to_bytes(),
        Sampled { dt: DT, stream: inverse.state() }.to_bytes(),
        observer.state().to_bytes(),
        controller.state().to_bytes(),
        controller.controller().state().to_bytes(),
    ]
}

#[test]
fn a_checksum_is_that_of_zip_files() {
    let bytes = stage().to_bytes();
    assert_eq!(sealed(1, &bytes[14..bytes.len() - 4]), bytes);
}

#[test]
fn states_go_on_bit_for_bit() {
    stages_with_memory().iter().for_each(states_of_a_stage_go_on);
}

fn states_of_a_stage_go_on(stage: &Stage) {
    let drives = [20.0, -5.0, 80.0, f64::NAN, 30.0, 29.0];
    let (mut forward, mut inverse) = (stage.forward(DT).unwrap(), stage.inverse(DT, None).unwrap());
    for drive in drives {
        forward.step(drive);
        inverse.step(0.1 * drive);
    }
    let (mut next_forward, mut next_inverse) = (stage.forward(DT).unwrap(), stage.inverse(DT, None).unwrap());
    let state = Sampled { dt: DT, stream: forward.state() };
    assert_eq!(Sampled::from_bytes(&state.to_bytes()).as_ref(), Ok(&state));
    next_forward.set_state(&Sampled::from_bytes(&state.to_bytes()).unwrap().stream).unwrap();
    let state = Sampled { dt: DT, stream: inverse.state() };
    assert_eq!(Sampled::from_bytes(&state.to_bytes()).as_ref(), Ok(&state));
    next_inverse.set_state(&Sampled::from_bytes(&state.to_bytes()).unwrap().stream).unwrap();
    for drive in drives {
        assert_eq!(next_forward.step(drive).to_bits(), forward.step(drive).to_bits());
        assert_eq!(next_inverse.step(0.1 * drive).to_bits(), inverse.step(0.1 * drive).to_bits());
    }
}

#[test]
fn controllers_go_on_bit_for_bit() {
    for mut controller in controllers() {
        let mut other = controller.clone();
        for k in 0..40 {
            controller.step(f64::from(k % 7).into(), f64::from(k % 5));
        }
        let state = controller.state();
        assert_eq!(StageControllerState::from_bytes(&state.to_bytes()).as_ref(), Ok(&state));
        let core = state.controller.clone();
        assert_eq!(ControllerState::from_bytes(&core.to_bytes()).as_ref(), Ok(&core));
        other.set_state(&StageControllerState::from_bytes(&state.to_bytes()).unwrap()).unwrap();
        for k in 0..40 {
            let row = (f64::from(k % 3), f64::from(k % 4));
            assert_eq!(other.step(row.0.into(), row.1).to_bits(), controller.step(row.0.into(), row.1).to_bits());
        }
    }
}

/// Thresholds that no order nests have a bank of operators for their memory.
#[test]
fn the_memory_of_a_bank_comes_back() {
    let model = ModifiedPrandtlIshlinskii::new(
        &[1.0, 0.1, 0.1],
        &[0.0, 2.0, 4.0],
        &[0.0, 6.0, 3.0],
        &[0.0, 0.1, 1.0],
        &[0.0, 0.2, 0.3],
        Offsets::default(),
    );
    let stage = Stage::new(StageParts::new(model.unwrap())).unwrap();
    let mut forward = stage.forward(DT).unwrap();
    // After eight small moves it is on a line.
    for (small_moves, memory) in [(0, "small_moves: 0"), (1, "small_moves: 1"), (8, "line: Some(Falling)")] {
        forward.reset();
        for k in 0..=small_moves {
            forward.step(5.0 - 0.01 * f64::from(k));
        }
        let state = Sampled { dt: DT, stream: forward.state() };
        assert!(format!("{state:?}").contains("Bank") && format!("{state:?}").contains(memory), "{state:?}");
        assert_eq!(Sampled::from_bytes(&state.to_bytes()), Ok(state));
    }
}

#[test]
fn refusals_say_what_came() {
    let bytes = stage().to_bytes();
    let changed =
        |place: usize, byte: u8| bytes.iter().enumerate().map(move |(k, old)| if k == place { byte } else { *old });
    let cases: [(Vec<u8>, &str); 8] = [
        (vec![], "got bytes that do not begin with \"mpi_hyst\""),
        (b"{\"schema\": 1}".to_vec(), "got bytes that do not begin with \"mpi_hyst\""),
        (bytes[..10].to_vec(), "got 10 bytes, which end too early"),
        (bytes[..bytes.len() - 1].to_vec(), "which end too early"),
        ([&bytes[..], b"\n"].concat(), "got 1 bytes too many"),
        (changed(8, 4).collect(), "got the state of a controller"),
        (changed(9, 1).collect(), "got version 1 instead of 2: another release wrote it"),
        (changed(30, bytes[30] ^ 1).collect(), "got bytes that were changed: their checksum differs"),
    ];
    for (bytes, expected) in cases {
        let error = Stage::from_bytes(&bytes).unwrap_err().to_string();
        assert!(error.starts_with("bytes: expected a stage as bytes, ") && error.contains(expected), "{error}");
    }
}
