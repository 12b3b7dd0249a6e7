//! Shows what Embree writes when `embree4-rs` asks it for a hit.
//!
//! The crate keeps its `RTCRayHit` in a local variable that no caller can reach. But its call of `rtcIntersect1` is
//! bound when this program is linked, and a function of that name here comes before the library's. So the query can be
//! looked at on its way: first in a fenced copy, where nothing can be harmed, then in the crate's own stack frame.

use std::ffi::{CStr, c_char, c_void};
use std::mem::size_of;
use std::process::ExitCode;
use std::sync::atomic::{AtomicUsize, Ordering};

use embree4_rs::geometry::TriangleMeshGeometry;
use embree4_rs::{Device, Scene};
use embree4_sys::{RTCIntersectArguments, RTCRay, RTCRayHit, RTCScene};

type Intersect1 = unsafe extern "C" fn(RTCScene, *mut c_void, *mut RTCIntersectArguments);

unsafe extern "C" {
    fn dlsym(handle: *mut c_void, symbol: *const c_char) -> *mut c_void;
}

const FENCE: u8 = 0xA5;
const SIZE: usize = size_of::<RTCRayHit>();

/// How many bytes Embree wrote past the crate's struct, over all queries.
static BYTES_PAST: AtomicUsize = AtomicUsize::new(0);

#[repr(C, align(64))]
struct Room([u8; 256]);

/// Stands between `embree4-rs` and the library.
#[unsafe(no_mangle)]
unsafe extern "C" fn rtcIntersect1(scene: RTCScene, rayhit: *mut RTCRayHit, args: *mut RTCIntersectArguments) {
    const NAME: &CStr = c"rtcIntersect1";
    const RTLD_NEXT: *mut c_void = -1_isize as *mut c_void;
    // SAFETY: the next object with this symbol is Embree, whose function has this type.
    let real: Intersect1 = unsafe { std::mem::transmute(dlsym(RTLD_NEXT, NAME.as_ptr())) };

    let mut room = Room([FENCE; 256]);
    // SAFETY: `rayhit` points at `SIZE` bytes, for which there is room; 256 bytes hold whatever Embree takes a hit to
    // be.
    unsafe {
        room.0.as_mut_ptr().copy_from_nonoverlapping(rayhit.cast(), SIZE);
        real(scene, room.0.as_mut_ptr().cast(), args);
    }
    let changed: Vec<usize> = (SIZE..room.0.len()).filter(|&at| room.0[at] != FENCE).collect();
    println!("in a fenced copy: bytes {changed:?} written, the struct ends at {SIZE}");
    BYTES_PAST.fetch_add(changed.len(), Ordering::Relaxed);

    // SAFETY: none for what the real call does: that is the fault on show. The word read before and after lies in the
    // crate's stack frame or its caller's, both alive.
    unsafe {
        let behind = rayhit.add(1).cast::<u32>();
        let before = behind.read_volatile();
        real(scene, rayhit.cast(), args);
        println!(
            "in the crate's stack frame: the word behind the struct was {before:#010x}, is {:#010x}",
            behind.read_volatile()
        );
    }
}

fn main() -> anyhow::Result<ExitCode> {
    let device = Device::try_new(None)?;
    let scene = Scene::try_new(device, Default::default())?;
    let mesh = TriangleMeshGeometry::try_new(
        &scene.device,
        &[(0.0, 0.0, 0.0), (2.0, 0.0, 0.0), (0.0, 4.0, 0.0)],
        &[(0, 1, 2)],
    )?;
    scene.attach_geometry(&mesh)?;
    let scene = scene.commit()?;
    let ray = RTCRay {
        org_x: 0.5,
        org_y: 1.0,
        org_z: -3.0,
        dir_z: 1.0,
        tfar: f32::INFINITY,
        mask: u32::MAX,
        ..Default::default()
    };
    let hit = scene.intersect_1(ray, None)?;
    println!("intersect_1: {}", if hit.is_some() { "a hit" } else { "no hit" });

    Ok(match BYTES_PAST.load(Ordering::Relaxed) {
        0 => {
            println!("intact: Embree stays inside the struct of the crate");
            ExitCode::SUCCESS
        }
        bytes => {
            println!("CORRUPT: Embree writes {bytes} bytes past the struct of the crate, into its stack");
            ExitCode::FAILURE
        }
    })
}
