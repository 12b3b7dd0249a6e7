//! Embree's device: the object that everything else of Embree belongs to.

use std::cell::RefCell;
use std::ffi::{CStr, CString, c_char, c_void};
use std::ptr::{self, NonNull};

use super::ffi;

/// The first version with the hit layout that we compile against, as Embree writes it: major · 10000 + minor · 100 +
/// patch.
const OLDEST: isize = 40300;

/// More build threads than any machine gains by; it bounds what Embree allocates per thread.
const MAX_THREADS: usize = 1024;

/// Why Embree cannot be used, or what it objected to.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum EmbreeError {
    /// There is no device.
    #[error("Embree gives no device: {0}")]
    NoDevice(&'static str),
    /// The library is older than the layout of our structs.
    #[error("Embree {0} is too old: 4.3 or later is needed (set EMBREE_DIR and build again)")]
    TooOld(String),
    /// A call failed.
    #[error("Embree reports {kind}{}{message}", if message.is_empty() { "" } else { ": " })]
    Reported {
        /// The kind of error, in words.
        kind: &'static str,
        /// What Embree says about it; may be empty.
        message: String,
    },
    /// The library reads or writes rays in another layout than ours.
    #[error("Embree {version} does not fit this build: {what}")]
    Layout {
        /// The library's version.
        version: String,
        /// What the canary query showed.
        what: String,
    },
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
}

// SAFETY: a device belongs to no thread. Its reference count is atomic, its properties never change after `new`, and
// its error is kept once per thread by Embree. Nothing else can be reached through `&Device`.
unsafe impl Send for Device {}
// SAFETY: as above.
unsafe impl Sync for Device {}

impl Device {
    /// Opens a device whose builds use `threads` threads (at most 1024; 0 leaves the number to Embree). Queries always
    /// run on the caller's thread.
    ///
    /// # Errors
    /// [`EmbreeError::NoDevice`] if Embree refuses, [`EmbreeError::TooOld`] before version 4.3.
    pub fn new(threads: usize) -> Result<Self, EmbreeError> {
        // Affinity stays off: pinned build threads would crowd the cores that rayon's threads are on.
        let config = format!("threads={},set_affinity=0", threads.min(MAX_THREADS));
        let config = CString::new(config).map_err(|_| EmbreeError::NoDevice("its configuration holds a NUL"))?;
        // SAFETY: `config` is a C string, and Embree has copied what it needs when the call returns.
        let handle = unsafe { ffi::rtcNewDevice(config.as_ptr()) };
        let Some(handle) = NonNull::new(handle) else {
            // SAFETY: null asks for the error of this thread's failed `rtcNewDevice`.
            return Err(EmbreeError::NoDevice(in_words(unsafe {
                ffi::rtcGetDeviceError(ptr::null_mut())
            })));
        };
        let device = Self { handle };
        if device.property(ffi::RTC_DEVICE_PROPERTY_VERSION) < OLDEST {
            return Err(EmbreeError::TooOld(device.version()));
        }
        // SAFETY: the device is alive; `remember` needs no user pointer and lives as long as the program.
        unsafe { ffi::rtcSetDeviceErrorFunction(device.handle(), Some(remember), ptr::null_mut()) };
        Ok(device)
    }

    /// The version of the library that is loaded, such as "4.4.0".
    pub fn version(&self) -> String {
        let version = self.property(ffi::RTC_DEVICE_PROPERTY_VERSION);
        format!("{}.{}.{}", version / 10000, version / 100 % 100, version % 100)
    }

    /// Asks whether a call on this thread has failed since the last time, through this device. Costs 11 to 33 ns: once
    /// a batch, not once a ray.
    ///
    /// # Errors
    /// [`EmbreeError::Reported`] with the first error since then.
    pub fn check(&self) -> Result<(), EmbreeError> {
        // SAFETY: the device is alive.
        match unsafe { ffi::rtcGetDeviceError(self.handle()) } {
            ffi::RTC_ERROR_NONE => Ok(()),
            code => Err(EmbreeError::Reported {
                kind: in_words(code),
                message: MESSAGE.take(),
            }),
        }
    }

    /// For calls of Embree; valid as long as `self`.
    pub(crate) fn handle(&self) -> ffi::RTCDevice {
        self.handle.as_ptr()
    }

    fn property(&self, property: ffi::RTCDeviceProperty) -> isize {
        // SAFETY: the device is alive; an unknown property is an error that Embree reports, not undefined behaviour.
        unsafe { ffi::rtcGetDeviceProperty(self.handle(), property) }
    }
}

impl Clone for Device {
    fn clone(&self) -> Self {
        // SAFETY: the device is alive; the count raised here is lowered by the clone's `drop`.
        unsafe { ffi::rtcRetainDevice(self.handle()) };
        Self { handle: self.handle }
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: each `Device` owns one count. Scenes and geometries hold counts of their own.
        unsafe { ffi::rtcReleaseDevice(self.handle()) };
    }
}

thread_local! {
    /// The message of the first error that `check` has not yet fetched on this thread: Embree 4.3 hands it to a
    /// callback only.
    static MESSAGE: RefCell<String> = const { RefCell::new(String::new()) };
}

/// Keeps an error's message for [`Device::check`]. Must not panic: there is C++ above it on the stack.
unsafe extern "C" fn remember(_user: *mut c_void, _code: ffi::RTCError, message: *const c_char) {
    if message.is_null() {
        return;
    }
    // SAFETY: Embree passes a C string that lives until this returns.
    let message = unsafe { CStr::from_ptr(message) }.to_string_lossy();
    // A thread that is ending has no place to keep it, and then nobody asks either.
    let _ = MESSAGE.try_with(|kept| {
        if let Ok(mut kept) = kept.try_borrow_mut()
            && kept.is_empty()
        {
            kept.push_str(&message);
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
    use super::*;

    /// A misuse that Embree notices on this device.
    fn misuse(device: &Device) {
        // SAFETY: the device is alive; no geometry has type 99, and Embree answers null and an error.
        let geometry = unsafe { ffi::rtcNewGeometry(device.handle(), 99) };
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
    fn a_clone_outlives_the_original() {
        let clone = Device::new(1).unwrap().clone();
        assert!(clone.version().starts_with('4'));
    }
}
