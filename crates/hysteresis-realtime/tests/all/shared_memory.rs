//! Shared memory between two mappings of one file, as two processes have it.

use std::fs;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use hysteresis_realtime::io::{Block, Io, SharedMemoryIo, SharedMemoryPlant};

/// The number of a value tells what the value must be.
fn value_of(number: u64) -> f64 {
    f64::from_bits(number.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 2)
}

/// The writer never rests, so that many of the looks fall into a write.
#[test]
fn what_is_read_is_whole() {
    let (block, done) = (Block::default(), AtomicBool::new(false));
    block.write(0, value_of(0));
    thread::scope(|scope| {
        scope.spawn(|| {
            let mut number = 0;
            while !done.load(Ordering::Relaxed) {
                number += 1;
                block.write(number, value_of(number));
            }
        });
        let (mut changes, mut newest, mut whole) = (0, 0, true);
        // Where both threads share a processor, few changes are seen: then it ends by the number of looks.
        for _ in 0..100_000_000 {
            if let Some((number, value)) = block.read()
                && number != newest
            {
                whole &= value == value_of(number) && number > newest;
                (changes, newest) = (changes + 1, number);
            }
            if changes == 300_000 {
                break;
            }
        }
        // Before any assertion, or the writer would go on for ever.
        done.store(true, Ordering::Relaxed);
        assert!(whole, "a torn read");
        assert!(changes > 0, "the writer was never seen");
    });
}

#[test]
fn the_layout_is_the_documented_one() -> std::io::Result<()> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("stage");
    let mut io = SharedMemoryIo::create(&path)?;
    let mut plant = SharedMemoryPlant::open(&path)?;
    for measurement in [0.5, 1.5, 2.5] {
        plant.write(measurement);
    }
    io.write(20.0).unwrap();
    io.write(-30.0).unwrap();
    let bytes = fs::read(&path)?;
    let number = |offset: usize| u64::from_ne_bytes(bytes[offset..offset + 8].try_into().unwrap());
    assert_eq!((bytes.len(), &bytes[..8]), (256, &b"MPIHYST1"[..]));
    assert_eq!((number(64), number(72), f64::from_bits(number(80))), (6, 2, 2.5));
    assert_eq!((number(128), number(136), f64::from_bits(number(144))), (4, 1, -30.0));
    Ok(())
}

#[cfg(unix)]
#[test]
fn a_plant_that_died_while_it_wrote_gives_nothing_and_its_successor_goes_on() -> std::io::Result<()> {
    use std::os::unix::fs::FileExt;
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("stage");
    let mut io = SharedMemoryIo::create(&path)?;
    let mut plant = SharedMemoryPlant::open(&path)?;
    plant.write(1.5);
    assert_eq!(io.read(), Ok(Some(1.5)));
    let file = fs::OpenOptions::new().write(true).open(&path)?;
    file.write_all_at(&3_u64.to_ne_bytes(), 64)?;
    assert_eq!(io.read(), Ok(None));
    plant.write(2.5);
    assert_eq!(io.read(), Ok(Some(2.5)));
    Ok(())
}

#[test]
fn only_the_memory_of_a_loop_is_opened() -> std::io::Result<()> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("stage");
    fs::write(&path, [0; 100])?;
    let error = SharedMemoryPlant::open(&path).unwrap_err();
    assert!(error.to_string().ends_with("stage: expected 256 bytes, got 100"), "{error}");
    fs::write(&path, [0; 256])?;
    let error = SharedMemoryPlant::open(&path).unwrap_err();
    assert!(error.to_string().ends_with("stage: expected a file that begins with MPIHYST1"), "{error}");
    assert!(SharedMemoryPlant::open(&folder.path().join("none")).is_err());
    Ok(())
}

#[test]
fn a_loop_takes_over_what_another_one_has_left_and_an_empty_file() -> std::io::Result<()> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("stage");
    fs::write(&path, [])?;
    for _ in 0..2 {
        let mut io = SharedMemoryIo::create(&path)?;
        let mut plant = SharedMemoryPlant::open(&path)?;
        assert_eq!((io.read(), plant.read()), (Ok(None), None), "what was there before is none of this run");
        plant.write(1.5);
        io.write(20.0).unwrap();
        assert_eq!((io.read(), plant.read()), (Ok(Some(1.5)), Some((0, 20.0))));
    }
    fs::write(&path, b"MPIHYST1")?;
    SharedMemoryIo::create(&path)?;
    assert_eq!(fs::metadata(&path)?.len(), 256);
    Ok(())
}

#[test]
fn any_other_file_stays_as_it_is() -> std::io::Result<()> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("stage.json");
    for content in [&b"{\"format\": \"mpi_hyst stage\"}"[..], b"MPI", &[0; 256]] {
        fs::write(&path, content)?;
        let error = SharedMemoryIo::create(&path).unwrap_err();
        assert_eq!(error.to_string(), "expected a new or empty file, or one that begins with MPIHYST1");
        assert_eq!(fs::read(&path)?, content);
    }
    let error = SharedMemoryIo::create(folder.path()).unwrap_err();
    assert_eq!(error.to_string(), "is not a regular file");
    Ok(())
}

#[test]
fn two_loops_do_not_share_a_file() -> std::io::Result<()> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("stage");
    let mut io = SharedMemoryIo::create(&path)?;
    io.write(20.0).unwrap();
    let error = SharedMemoryIo::create(&path).unwrap_err();
    assert_eq!((error.kind(), error.to_string().as_str()), (std::io::ErrorKind::ResourceBusy, "another loop uses it"));
    let plant = SharedMemoryPlant::open(&path)?;
    assert_eq!(plant.read(), Some((0, 20.0)), "the first one goes on");
    // A plant holds no lock.
    drop(io);
    assert!(SharedMemoryIo::create(&path).is_ok());
    Ok(())
}
