//! Threads for what the library does outside of a prepared scene. After a fork the parent's threads are gone, so a child starts its own.

use std::process;
use std::sync::{Arc, Mutex, PoisonError};

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use rayon::ThreadPool;

static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);

fn pool() -> PyResult<Arc<ThreadPool>> {
    let mut held = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    match &*held {
        Some((of, pool)) if *of == process::id() => return Ok(pool.clone()),
        _ => {}
    }
    let pool = rayon::ThreadPoolBuilder::new().build();
    let pool = Arc::new(pool.map_err(|why| PyRuntimeError::new_err(format!("cannot start the threads: {why}")))?);
    // The parent's pool is left alone: to end it would wait for threads that are not here.
    std::mem::forget(held.replace((process::id(), pool.clone())));
    Ok(pool)
}

/// Does `work` on this process's threads, without Python's lock.
pub fn detached<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    py.detach(|| Ok(pool()?.install(work)))
}
