//! What a loop on the clock reads from and writes to.

use std::ffi::c_void;
use std::path::{Path, PathBuf};

use hysteresis_python_macros::methods;
use hysteresis_realtime::io::{Fault, FunctionIo, Io, ReadFunction, WriteFunction};
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyDict};

use crate::convert::arguments::word;
use crate::convert::errors::{self, Place, not_converted, unexpected};
use crate::plant::foreign::stated_limits;

/// Two functions of C: any driver of any vendor, through ctypes.
///
/// `int read(void *context, double *measurement)` writes the measurement of now and returns 0; it returns a number
/// above 0 if there is none that is newer, and one below 0 for a fault. `int write(void *context, double drive)`
/// returns 0, or another number for a fault. Both are called once per sample from the thread of the loop, and must not
/// wait. As with ctypes itself, a function of another signature crashes the process.
///
/// This is for functions of a library. A function in Python that raises tells nobody: ctypes prints the exception and
/// returns 0, so a drive that was never put out counts as written. Give `run` an object with `read` and `write` for
/// Python: what that raises ends the loop, at rest if it can still be written to.
///
/// Parameters
/// ----------
/// read, write : ctypes functions, or int
///     Or their addresses.
/// context : int
///     An address that both get.
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import ctypes
/// >>> import mpi_hyst as mh
/// >>> @ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.POINTER(ctypes.c_double))
/// ... def read(context, measurement):  # stands for a function of the driver's library
/// ...     measurement[0] = 1.5
/// ...     return 0
/// >>> @ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_double)
/// ... def write(context, drive):
/// ...     try:
/// ...         pass  # the driver
/// ...     except Exception:
/// ...         return -1  # else ctypes returns 0, which is success
/// ...     return 0
/// >>> io = mh.realtime.Functions(read, write)
#[pyclass(module = "mpi_hyst.realtime", frozen)]
pub(crate) struct Functions {
    read: usize,
    write: usize,
    context: usize,
    /// What keeps the functions alive.
    _kept: [Py<PyAny>; 2],
}

#[methods]
impl Functions {
    #[new]
    fn new(
        #[py("object")] read: &Bound<'_, PyAny>,
        #[py("object")] write: &Bound<'_, PyAny>,
        #[py(= 0)] context: usize,
    ) -> PyResult<Self> {
        Ok(Self {
            read: address("read", read)?,
            write: address("write", write)?,
            context,
            _kept: [read, write].map(|function| function.clone().unbind()),
        })
    }

    fn __repr__(&self) -> String {
        format!("Functions({:#x}, {:#x}, context={:#x})", self.read, self.write, self.context)
    }

    /// Itself: it never changes. It cannot be pickled, as its addresses are those of this process.
    fn __deepcopy__<'py>(slf: Bound<'py, Self>, #[py("Any")] _memo: &Bound<'_, PyAny>) -> Bound<'py, Self> {
        slf
    }
}

impl Functions {
    pub(super) fn io(&self) -> FunctionIo {
        // SAFETY: whoever made this object says that functions of these signatures are there, as with ctypes; `_kept`
        // keeps those that ctypes made, and the caller of the loop keeps this object.
        unsafe {
            let read = std::mem::transmute::<*const c_void, ReadFunction>(self.read as *const c_void);
            let write = std::mem::transmute::<*const c_void, WriteFunction>(self.write as *const c_void);
            FunctionIo::new(read, write, self.context as *mut c_void)
        }
    }
}

fn address(name: &'static str, function: &Bound<'_, PyAny>) -> PyResult<usize> {
    let expected = "a function of ctypes, or an address other than 0";
    if let Ok(address) = function.extract::<usize>() {
        return if address == 0 {
            Err(errors::value(name, format_args!("expected {expected}, got 0")))
        } else {
            Ok(address)
        };
    }
    let ctypes = function.py().import("ctypes")?;
    let pointer = ctypes.getattr("c_void_p")?;
    match ctypes.call_method1("cast", (function, pointer)).and_then(|cast| cast.getattr("value")?.extract()) {
        Ok(address) if function.is_callable() => Ok(address),
        _ => Err(unexpected(name, expected, function)),
    }
}

/// A plant that talks in datagrams, on another computer or in another process.
///
/// A datagram has 16 bytes, little-endian: a number that counts upwards (uint64), and a float64. The plant sends
/// measurements to `local`, the loop drives to `plant`. The newest measurement counts. Lost ones are not fresh: the
/// watchdog sees to it. A drive is written when the network has taken it: nobody confirms that it has arrived, also not
/// the rest drive, which is sent 20 times. So the plant needs a watchdog of its own that goes to rest when no drives
/// come. The report counts the datagrams: `LoopReport.to_dict()["datagrams"]`. It warns that the rest drive may have
/// reached nobody, but only if the other computer says that nobody listens: `LoopReport.rest_refused`. One that is off
/// says nothing.
///
/// Parameters
/// ----------
/// plant, local : str
///     "host:port".
///
/// Raises
/// ------
/// ValueError
///     That names the argument, for what is no host and port. What the network refuses is an OSError of `run`.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> io = mh.realtime.Udp("127.0.0.1:47001", local="127.0.0.1:47002")
/// >>> io.plant
/// '127.0.0.1:47001'
#[pyclass(module = "mpi_hyst.realtime", frozen, get_all, eq, hash)]
#[derive(PartialEq, Eq, Hash)]
pub(crate) struct Udp {
    /// Where drives go, and from where measurements are taken.
    pub(super) plant: String,
    /// Where measurements come in.
    pub(super) local: String,
}

#[methods]
impl Udp {
    #[new]
    fn new(#[py("str")] plant: &Bound<'_, PyAny>, #[py(*, "str")] local: &Bound<'_, PyAny>) -> PyResult<Self> {
        let checked = |name, given| {
            let address = word(name, "\"host:port\"", given)?;
            let (host, port) = address.rsplit_once(':').unwrap_or_default();
            if host.is_empty() || port.parse::<u16>().is_err() {
                return Err(errors::value(name, format_args!("expected \"host:port\", got {address:?}")));
            }
            Ok(address)
        };
        Ok(Self { plant: checked("plant", plant)?, local: checked("local", local)? })
    }

    fn __repr__(&self) -> String {
        format!("Udp({:?}, local={:?})", self.plant, self.local)
    }

    #[py(-> "tuple[tuple[str], dict[str, str]]")]
    fn __getnewargs_ex__<'py>(&self, py: Python<'py>) -> PyResult<((&str,), Bound<'py, PyDict>)> {
        Ok(((&self.plant,), [("local", &self.local)].into_py_dict(py)?))
    }
}

/// Memory that another process maps too.
///
/// The loop makes a file of 256 bytes, in /dev/shm on Linux. The plant writes a measurement at offset 64, and reads the
/// drive at offset 128. Each is a lock, a number and a float64, 8 bytes each. To write: make the lock odd, write a new
/// number and the value, make the lock the next even number. To read: what was read is whole if the lock was even and
/// is the same after it.
///
/// While the loop runs it has an exclusive lock on the file (flock), so a second loop is refused. No other process may
/// make the file shorter meanwhile: the system then ends the loop where it is (SIGBUS).
///
/// Parameters
/// ----------
/// path : str or path-like
///     The file: a new or empty one, or that of a loop that has ended. `run` refuses any other with OSError.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> io = mh.realtime.SharedMemory("/dev/shm/stage")
/// >>> str(io.path)
/// '/dev/shm/stage'
#[pyclass(module = "mpi_hyst.realtime", frozen, get_all, eq, hash)]
#[derive(PartialEq, Eq, Hash)]
pub(crate) struct SharedMemory {
    /// The file.
    pub(super) path: PathBuf,
}

#[methods]
impl SharedMemory {
    #[new]
    fn new(path: PathBuf) -> PyResult<Self> {
        Ok(Self { path })
    }

    fn __repr__(&self) -> String {
        format!("SharedMemory({:?})", self.path.to_string_lossy())
    }

    fn __getnewargs__(&self) -> (&Path,) {
        (&self.path,)
    }
}

/// The methods `read` and `write` of an object, and the first exception that one of them raised.
pub(super) struct ForeignIo {
    read: Py<PyAny>,
    write: Py<PyAny>,
    pub(super) raised: Option<PyErr>,
}

impl ForeignIo {
    /// Refuses limits that the object states and that the `drive` of the controller may leave.
    pub(super) fn new(object: &Bound<'_, PyAny>, drive: (f64, f64)) -> PyResult<Self> {
        let method = |name| object.getattr_opt(name).map(|found| found.filter(PyAnyMethods::is_callable));
        let (Some(read), Some(write)) = (method("read")?, method("write")?) else {
            let expected = "a Plant, Functions, Udp, SharedMemory, or an object with read() and write(drive)";
            return Err(unexpected("io", expected, object));
        };
        let stated = object.getattr_opt("limits")?.filter(|limits| !limits.is_none() && !limits.is_callable());
        if let Some(limits) = stated {
            let place = Place::part("io", "io.limits");
            let (low, high) = stated_limits(place, &limits)?;
            if drive.0 < low || drive.1 > high {
                let expected = format_args!("expected limits that hold those of the controller, {drive:?}");
                return Err(errors::value(place, format_args!("{expected}, got ({low:?}, {high:?})")));
            }
        }
        Ok(Self { read: read.unbind(), write: write.unbind(), raised: None })
    }

    fn attached<T>(&mut self, call: impl FnOnce(&Self, Python<'_>) -> PyResult<T>) -> Result<T, Fault> {
        Python::attach(|py| call(self, py)).map_err(|error| {
            self.raised.get_or_insert(error);
            Fault::Raised
        })
    }
}

impl Io for ForeignIo {
    fn read(&mut self) -> Result<Option<f64>, Fault> {
        self.attached(|io, py| {
            let read = io.read.bind(py).call0()?;
            let place = Place::part("io", "io.read");
            read.extract().map_err(|error| not_converted(place, "a number or None", &read, error))
        })
    }

    fn write(&mut self, drive: f64) -> Result<(), Fault> {
        self.attached(|io, py| io.write.call1(py, (drive,)).map(drop))
    }
}
