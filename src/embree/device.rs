//! Embree's device, which owns all other Embree objects.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::env;
use std::ffi::{CStr, CString, c_char, c_void};
use std::path::{Path, PathBuf};
use std::ptr::{self, NonNull};
use std::sync::atomic::{AtomicBool, Ordering};

use super::ffi::{self, Functions};
use super::library::{Embree, embree};
use crate::shape::SkipIdAllocator;

/// The first version with the hit layout of our bindings, encoded like Embree's: major · 10000 + minor · 100 + patch.
const OLDEST: isize = 40300;

/// More build threads than any machine benefits from; bounds Embree's per-thread allocations.
const MAX_THREADS: usize = 1024;

/// Whether this process has opened a device.
static OPENED: AtomicBool = AtomicBool::new(false);

/// The environment variable with additional settings in Embree's syntax.
const SETTINGS: &str = "OCTOLUX_EMBREE";

/// Reasons why Embree cannot be used, or errors that it reported.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum EmbreeError {
    /// There is no usable library.
    #[error("{what}")]
    Missing {
        /// The problem, as a sentence.
        what: String,
        /// A remedy.
        remedy: &'static str,
    },
    /// There is no device.
    #[error("Embree gives no device: {0}")]
    NoDevice(&'static str),
    /// Embree returned no object, without a reason.
    #[error("Embree gives {0}")]
    Refused(&'static str),
    /// The library is older than the layout of our structs.
    #[error("{} is Embree {version}, which is too old: 4.3 or later is needed", path.display())]
    TooOld {
        /// The library.
        path: PathBuf,
        /// Its version.
        version: String,
    },
    /// A call failed.
    #[error("Embree reports {kind}{}{message}", if message.is_empty() { "" } else { ": " })]
    Reported {
        /// The kind of error, in words.
        kind: &'static str,
        /// Embree's message; may be empty.
        message: String,
    },
    /// The emissive triangles exceed the number of skip ids.
    #[error("meshes that emit have more than {} triangles in all", SkipIdAllocator::MOST)]
    TooManyLights,
    /// The library uses another layout for rays than our bindings.
    #[error("Embree {version} does not fit this build: {what}")]
    Layout {
        /// The library's version.
        version: String,
        /// What the canary query found.
        what: String,
    },
}

/// The packet widths for which Embree has native kernels. It also accepts other widths, but traces their rays one by one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Packets {
    /// Packets of 8 rays.
    pub eight: bool,
    /// Packets of 16 rays.
    pub sixteen: bool,
}

impl Packets {
    /// Whether Embree has kernels for packets of `lanes` rays; a single ray is always one.
    pub const fn has(self, lanes: usize) -> bool {
        match lanes {
            1 => true,
            8 => self.eight,
            16 => self.sixteen,
            _ => false,
        }
    }
}

/// An Embree device, released when its last clone is dropped.
///
/// ```
/// use octolux::embree::{Device, EmbreeError, layout_canary};
///
/// let device = Device::new(2)?;
/// layout_canary(&device)?;
/// println!("Embree {}", device.version());
/// # Ok::<(), EmbreeError>(())
/// ```
#[derive(Debug)]
pub struct Device {
    handle: NonNull<ffi::RTCDeviceTy>,
    embree: &'static Embree,
}

// SAFETY: a device belongs to no thread. Its reference count is atomic, its properties never change after `new`, and
// its error is kept once per thread by Embree. Nothing else can be reached through `&Device`.
unsafe impl Send for Device {}
// SAFETY: as above.
unsafe impl Sync for Device {}

impl EmbreeError {
    /// A remedy, if there is one.
    pub const fn remedy(&self) -> &'static str {
        match self {
            Self::Missing { remedy, .. } => remedy,
            Self::TooManyLights => "let fewer triangles emit",
            Self::TooOld { .. } => "set EMBREE_DIR to the folder above the lib/ of a later one",
            _ => "",
        }
    }
}

impl Device {
    /// Opens a device whose builds use `threads` threads (at most 1024; 0 leaves the number to Embree). Only the first device of a
    /// process builds with a single thread; later ones use at least two. Queries always run on the caller's thread. The environment
    /// variable `OCTOLUX_EMBREE` may add settings in Embree's syntax, such as `isa=avx2`.
    ///
    /// # Errors
    /// [`EmbreeError::Missing`] without a library, [`EmbreeError::TooOld`] before version 4.3, [`EmbreeError::NoDevice`] if Embree
    /// fails.
    pub fn new(threads: usize) -> Result<Self, EmbreeError> {
        // Under a limit of one thread, a worker of oneTBB that an earlier device started yields in a loop for as long as the device
        // lives: 17 ms of processor time in 20 (Embree 4.4.0 from Python's wheel). A theorem that renders many scenes took 20 s of
        // processor time with one thread and 15 s with two (`docs/performance-log.md`).
        let threads = if OPENED.swap(true, Ordering::Relaxed) && threads == 1 {
            2
        } else {
            threads
        };
        // Affinity stays off: pinned build threads would compete with rayon's threads for cores.
        let more = env::var(SETTINGS).unwrap_or_default();
        Self::configured(
            &format!("threads={},set_affinity=0,{more}", threads.min(MAX_THREADS)),
            embree()?,
        )
    }

    /// A device with settings in Embree's syntax.
    pub(super) fn configured(settings: &str, embree: &'static Embree) -> Result<Self, EmbreeError> {
        let settings = CString::new(settings).map_err(|_| EmbreeError::NoDevice("its configuration holds a NUL"))?;
        let functions = &embree.functions;
        // SAFETY: `settings` is a C string, and Embree has copied what it needs when the call returns.
        let handle = unsafe { functions.rtcNewDevice(settings.as_ptr()) };
        let Some(handle) = NonNull::new(handle) else {
            // SAFETY: null asks for the error of this thread's failed `rtcNewDevice`.
            return Err(EmbreeError::NoDevice(in_words(unsafe {
                functions.rtcGetDeviceError(ptr::null_mut())
            })));
        };
        let device = Self { handle, embree };
        // Discards an unread message of an earlier device with the same address.
        MESSAGES.with_borrow_mut(|kept| kept.remove(&device.handle().addr()));
        if device.property(ffi::RTC_DEVICE_PROPERTY_VERSION) < OLDEST {
            return Err(EmbreeError::TooOld {
                path: embree.path.clone(),
                version: device.version(),
            });
        }
        // SAFETY: the device is alive. Its own address, which is never followed, tells its errors from others'; `remember`
        // lives as long as the program.
        unsafe { functions.rtcSetDeviceErrorFunction(device.handle(), Some(remember), device.handle().cast()) };
        Ok(device)
    }

    /// Embree's functions.
    #[inline(always)]
    pub(super) const fn functions(&self) -> &'static Functions {
        &self.embree.functions
    }

    /// The file of the open library, or the name given to the system's loader.
    pub fn library(&self) -> &Path {
        &self.embree.path
    }

    /// The version of the library that is loaded, such as "4.4.0".
    pub fn version(&self) -> String {
        let version = self.property(ffi::RTC_DEVICE_PROPERTY_VERSION);
        format!("{}.{}.{}", version / 10000, version / 100 % 100, version % 100)
    }

    /// The packet widths for which the library has kernels on this processor, subject to settings such as `isa=avx2`.
    pub fn packets(&self) -> Packets {
        Packets {
            eight: self.property(ffi::RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED) != 0,
            sixteen: self.property(ffi::RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED) != 0,
        }
    }

    /// Reads and clears this thread's error on this device. Costs 11 to 33 ns: call it once per batch, not per ray.
    ///
    /// # Errors
    /// [`EmbreeError::Reported`] with the first error since the last call.
    pub fn check(&self) -> Result<(), EmbreeError> {
        // SAFETY: the device is alive.
        match unsafe { self.functions().rtcGetDeviceError(self.handle()) } {
            ffi::RTC_ERROR_NONE => Ok(()),
            code => Err(EmbreeError::Reported {
                kind: in_words(code),
                message: MESSAGES
                    .with_borrow_mut(|kept| kept.remove(&self.handle().addr()))
                    .unwrap_or_default(),
            }),
        }
    }

    /// The error of this thread's last call that returned null; `what` is used if Embree gives no error.
    pub(super) fn refusal(&self, what: &'static str) -> EmbreeError {
        self.check().err().unwrap_or(EmbreeError::Refused(what))
    }

    /// The handle for Embree calls; valid as long as `self`.
    pub(super) fn handle(&self) -> ffi::RTCDevice {
        self.handle.as_ptr()
    }

    fn property(&self, property: ffi::RTCDeviceProperty) -> isize {
        // SAFETY: the device is alive; an unknown property is an error that Embree reports, not undefined behaviour.
        unsafe { self.functions().rtcGetDeviceProperty(self.handle(), property) }
    }
}

impl Clone for Device {
    fn clone(&self) -> Self {
        // SAFETY: the device is alive; the count raised here is lowered by the clone's `drop`.
        unsafe { self.functions().rtcRetainDevice(self.handle()) };
        Self { ..*self }
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: each `Device` owns one count. Scenes and geometries hold counts of their own.
        unsafe { self.functions().rtcReleaseDevice(self.handle()) };
    }
}

thread_local! {
    /// For each device address, the message of the first error that `check` has not yet read on this thread. Embree 4.3 passes
    /// messages only to a callback.
    static MESSAGES: RefCell<BTreeMap<usize, String>> = const { RefCell::new(BTreeMap::new()) };
}

/// Stores an error's message for [`Device::check`]. Must not panic, because C++ frames are above it on the stack.
unsafe extern "C" fn remember(device: *mut c_void, _code: ffi::RTCError, message: *const c_char) {
    if message.is_null() {
        return;
    }
    // SAFETY: Embree passes a C string that lives until this returns.
    let message = unsafe { CStr::from_ptr(message) }.to_string_lossy();
    // A terminating thread cannot store it, but nobody reads it then either.
    let _ = MESSAGES.try_with(|kept| {
        if let Ok(mut kept) = kept.try_borrow_mut() {
            kept.entry(device.addr()).or_insert_with(|| message.into_owned());
        }
    });
}

fn in_words(code: ffi::RTCError) -> &'static str {
    match code {
        ffi::RTC_ERROR_INVALID_ARGUMENT => "an invalid argument",
        ffi::RTC_ERROR_INVALID_OPERATION => "an invalid operation",
        ffi::RTC_ERROR_OUT_OF_MEMORY => "that memory is exhausted",
        ffi::RTC_ERROR_UNSUPPORTED_CPU => "that this processor is not supported",
        ffi::RTC_ERROR_CANCELLED => "that the build was cancelled",
        _ => "an unknown error",
    }
}

#[cfg(test)]
mod tests {
    use std::sync::LazyLock;

    use super::*;

    /// A misuse that Embree reports on this device.
    fn misuse(device: &Device) {
        // SAFETY: the device is alive; no geometry has type 99, and Embree answers null and an error.
        let geometry = unsafe { device.functions().rtcNewGeometry(device.handle(), 99) };
        assert!(geometry.is_null());
    }

    #[test]
    fn the_version_is_known_and_new_enough() {
        let version = Device::new(1).unwrap().version();
        let parts: Vec<u32> = version.split('.').map(|part| part.parse().unwrap()).collect();
        assert!(parts.len() == 3 && parts >= vec![4, 3, 0], "{version}");
    }

    #[test]
    fn any_number_of_threads_opens_a_device() {
        for threads in [0, 1, 7, MAX_THREADS, usize::MAX] {
            assert_eq!(Device::new(threads).unwrap().check(), Ok(()), "{threads} threads");
        }
    }

    #[test]
    fn an_error_is_reported_once_with_embrees_own_words() {
        let device = Device::new(1).unwrap();
        misuse(&device);
        let error = device.check().unwrap_err();
        let EmbreeError::Reported { kind, message } = &error else {
            panic!("{error}")
        };
        assert!(!kind.is_empty() && !message.is_empty(), "{error}");
        assert_eq!(device.check(), Ok(()));
    }

    #[test]
    fn errors_stay_on_their_thread() {
        let device = Device::new(1).unwrap();
        std::thread::scope(|scope| scope.spawn(|| misuse(&device)).join()).unwrap();
        assert_eq!(device.check(), Ok(()));
    }

    #[test]
    fn messages_stay_with_their_device() {
        let [a, b] = [Device::new(1).unwrap(), Device::new(1).unwrap()];
        let misuse_of_buffer = |device: &Device| {
            // SAFETY: the device is alive; no property has this number, and Embree answers 0 and an error.
            let answer = unsafe { device.functions().rtcGetDeviceProperty(device.handle(), 9999) };
            assert_eq!(answer, 0);
        };
        misuse(&a);
        misuse_of_buffer(&b);
        let [of_a, of_b] = [&a, &b].map(|device| device.check().unwrap_err().to_string());
        assert_ne!(of_a, of_b);
        assert!(!of_b.contains("geometry"), "{of_b}");
    }

    #[test]
    fn an_old_library_is_refused_by_its_version_and_place() {
        unsafe extern "C" fn version_4_2(_: ffi::RTCDevice, _: ffi::RTCDeviceProperty) -> isize {
            40201
        }
        static OLD: LazyLock<Embree> = LazyLock::new(|| Embree {
            functions: Functions {
                rtcGetDeviceProperty: version_4_2,
                ..embree().unwrap().functions
            },
            path: "/some/lib/libembree4.so.4".into(),
        });
        let error = Device::configured("threads=1", &OLD).unwrap_err();
        let said = error.to_string();
        assert!(
            said.contains("/some/lib/libembree4.so.4") && said.contains("4.2.1"),
            "{said}"
        );
        assert!(error.remedy().contains("EMBREE_DIR"));
    }

    #[test]
    fn a_clone_outlives_the_original() {
        let clone = Device::new(1).unwrap().clone();
        assert!(clone.version().starts_with('4'));
    }
}
