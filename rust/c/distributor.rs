//! `gf_distributor`: least contact forces at every tick of a control loop, in memory of its own.

use std::cell::UnsafeCell;
use std::ffi::c_char;
use std::hash::RandomState;
use std::ptr;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::boundary::call;
use crate::contacts::{Contacts, GraspOptions};
use crate::control_loop::{ControlLoop, Question, control_loop};
use crate::distributor_options::DistributorOptions;
use crate::fault::{Fault, Outcome, Status};
use crate::grasp::{AnyGrasp, Grasp, borrowed};
use crate::heap::Heap;
use crate::memory::{self, check, check_length, copy_to, required};
use crate::solution::Solution;

/// Least contact forces of one grasp at a time. One thread at a time uses it. Its calls take memory from
/// the system only where they need more than `reserve`.
pub struct Distributor {
    busy: AtomicBool,
    state: UnsafeCell<State>,
}

struct State {
    /// What lies in the heap; `None` once it is dropped.
    control: Option<Box<dyn ControlLoop>>,
    heap: Heap,
    /// Whether a call ended with an error of the library, which may have left something half done.
    doubtful: bool,
}

/// While it lives, no other thread gets into the distributor.
struct ExclusiveUse<'a>(&'a AtomicBool);

impl Drop for ExclusiveUse<'_> {
    fn drop(&mut self) {
        self.0.store(false, Ordering::Release);
    }
}

impl Drop for State {
    fn drop(&mut self) {
        // SAFETY: the heap is dropped after `control`, and whoever drops the state is alone with it.
        let _scope = unsafe { Heap::scope(&raw mut self.heap) };
        self.control = None;
    }
}

impl State {
    /// Runs `body` with the distributor, in its heap.
    ///
    /// # Safety
    ///
    /// No other thread uses the state. `message` is NULL or has `size` bytes.
    unsafe fn enter(
        state: *mut Self,
        message: *mut c_char,
        size: usize,
        body: impl FnOnce(&mut Option<Box<dyn ControlLoop>>) -> Outcome,
    ) -> Status {
        // SAFETY: what is allocated in the scope belongs to `control` or ends with `call`. Allocations reach the heap
        // through this pointer only, and `control` and `doubtful` lie beside the heap.
        unsafe {
            let _scope = Heap::scope(&raw mut (*state).heap);
            let doubtful = &mut (*state).doubtful;
            let control = &mut (*state).control;
            let status = call(message, size, || {
                if let Some(control) = control.as_mut().filter(|_| *doubtful) {
                    control.forget();
                }
                *doubtful = false;
                body(control)
            });
            *doubtful = status == Status::InternalError;
            status
        }
    }
}

/// Runs `body` with the distributor behind a handle, unless another thread is using it.
///
/// # Safety
///
/// `distributor` is NULL or came from `gf_distributor_create` and is not destroyed meanwhile; `message` is NULL or has
/// `size` bytes.
unsafe fn with_distributor(
    distributor: *mut Distributor,
    message: *mut c_char,
    size: usize,
    body: impl FnOnce(&mut dyn ControlLoop) -> Outcome,
) -> Status {
    // SAFETY: the caller's promise.
    let refuse = |fault| unsafe { call(message, size, || Err(fault)) };
    if let Err(fault) = check("distributor", distributor) {
        return refuse(fault);
    }
    // SAFETY: the caller's promise.
    let Distributor { busy, state } = unsafe { &*distributor };
    if busy.swap(true, Ordering::Acquire) {
        return refuse(Fault::Busy);
    }
    let _turn = ExclusiveUse(busy);
    let body = |control: &mut Option<Box<dyn ControlLoop>>| match control {
        Some(control) => body(&mut **control),
        None => Err(Fault::NullPointer("distributor")),
    };
    // SAFETY: `busy` keeps other threads away; the caller's promise about the message.
    unsafe { State::enter(state.get(), message, size, body) }
}

/// Makes a distributor of a grasp, which it copies. `options` may be NULL for the defaults.
///
/// On an error `*distributor` is NULL, and the message names the argument and the value.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gf_distributor_create(
    grasp: *const Grasp,
    options: *const DistributorOptions,
    distributor: *mut *mut Distributor,
    message: *mut c_char,
    message_size: usize,
) -> Status {
    let body = || {
        check("distributor", distributor)?;
        // SAFETY: not NULL, aligned, and the header's rules.
        let (grasp, options) = unsafe {
            distributor.write(ptr::null_mut());
            (borrowed(grasp)?, memory::read_or_default(options)?)
        };
        let state = State { control: None, heap: Heap::new(), doubtful: false };
        let mut made = Box::new(Distributor { busy: AtomicBool::new(false), state: UnsafeCell::new(state) });
        let state = made.state.get_mut();
        let fill = |control: &mut Option<Box<dyn ControlLoop>>| {
            // SAFETY: the header's rules.
            *control = Some(unsafe { control_loop(grasp, &options) }?);
            Ok(Status::Solved)
        };
        // SAFETY: nobody else knows the state; the header's rules.
        let status = unsafe { State::enter(state, message, message_size, fill) };
        if status == Status::Solved {
            // The standard library asks the system once in each thread, when a hash table is first made.
            drop(RandomState::new());
            // Sets of contacts that limits have switched off are remembered, and an update makes the new distributor before
            // it drops the old one.
            let room = 12 * state.heap.used() + options.reserve();
            if !state.heap.reserve(room) {
                return Err(Fault::OutOfMemory);
            }
            // SAFETY: not NULL and aligned.
            unsafe { distributor.write(Box::into_raw(made)) };
        }
        Ok(status)
    };
    // SAFETY: the header's rules.
    unsafe { call(message, message_size, body) }
}

/// Ends a distributor; nothing for NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gf_distributor_destroy(distributor: *mut Distributor) {
    let body = || {
        if !distributor.is_null() {
            // SAFETY: it came from `gf_distributor_create`, and by the header's rules nobody uses it any more.
            drop(unsafe { Box::from_raw(distributor) });
        }
        Ok(Status::Solved)
    };
    // SAFETY: no buffer.
    unsafe { call(ptr::null_mut(), 0, body) };
}

/// Least forces that balance an external wrench: the wrenches of the forces sum to its opposite.
///
/// `external_wrench` has d numbers. `forces` gets m rows of k numbers in the contact frames; `num_forces` is m k. On an
/// error it keeps its numbers. `solution` may be NULL: without it a wrench like the last one takes a tenth of a
/// microsecond. For the control loop: see there.
#[unsafe(no_mangle)]
#[allow(clippy::too_many_arguments, reason = "the contract with C")]
pub unsafe extern "C" fn gf_distributor_solve(
    distributor: *mut Distributor,
    external_wrench: *const f64,
    wrench_dim: usize,
    forces: *mut f64,
    num_forces: usize,
    solution: *mut Solution,
    message: *mut c_char,
    message_size: usize,
) -> Status {
    let outputs = Outputs { forces, num_forces, solution, distance: ptr::null_mut() };
    // SAFETY: the header's rules.
    unsafe {
        compute(distributor, Question::Balance, external_wrench, wrench_dim, &outputs, message, message_size)
    }
}

/// Forces whose wrench comes nearest to balance, the least among those: the forces of `gf_distributor_solve` where that
/// succeeds within the limits. `nearest_limits` and `nearest_metric` of the options say within what limits, and nearest
/// in which norm.
///
/// Every wrench has nearest forces; `residual` holds what they leave unbalanced. Without limits the distance is proven for
/// forces up to ten times as strong as those returned. `distance` gets the norm of the residual, and `gap` of `solution`
/// what is proven of the forces: above `rtol` and 1e-9 less than asked for. Both may be NULL, the rest is as for
/// `gf_distributor_solve`. For the control loop: see there.
#[unsafe(no_mangle)]
#[allow(clippy::too_many_arguments, reason = "the contract with C")]
pub unsafe extern "C" fn gf_distributor_nearest(
    distributor: *mut Distributor,
    external_wrench: *const f64,
    wrench_dim: usize,
    forces: *mut f64,
    num_forces: usize,
    distance: *mut f64,
    solution: *mut Solution,
    message: *mut c_char,
    message_size: usize,
) -> Status {
    let outputs = Outputs { forces, num_forces, solution, distance };
    // SAFETY: the header's rules.
    unsafe {
        compute(distributor, Question::Nearest, external_wrench, wrench_dim, &outputs, message, message_size)
    }
}

/// Where an answer goes.
struct Outputs {
    forces: *mut f64,
    num_forces: usize,
    /// NULL where not asked for.
    solution: *mut Solution,
    /// NULL where not asked for.
    distance: *mut f64,
}

/// # Safety
///
/// The pointers keep the header's rules.
unsafe fn compute(
    distributor: *mut Distributor,
    question: Question,
    external_wrench: *const f64,
    wrench_dim: usize,
    outputs: &Outputs,
    message: *mut c_char,
    message_size: usize,
) -> Status {
    let body = |control: &mut dyn ControlLoop| {
        check("forces", outputs.forces)?;
        check_length("forces", outputs.num_forces, control.num_forces())?;
        if !outputs.distance.is_null() {
            check("distance", outputs.distance)?;
        }
        // SAFETY: the header's rules.
        let wrench = unsafe { required("external_wrench", external_wrench, wrench_dim) }?;
        let mut found = Solution::default();
        let wanted = !outputs.solution.is_null();
        let answer = control.compute(question, wrench, wanted.then_some(&mut found));
        if wanted {
            // SAFETY: the header's rules.
            unsafe { memory::write(outputs.solution, &found) }?;
        }
        let (forces, distance) = answer?;
        // SAFETY: the header's rules; `distance` is NULL or aligned.
        unsafe {
            copy_to("forces", outputs.forces, outputs.num_forces, forces)?;
            if !outputs.distance.is_null() {
                outputs.distance.write(distance);
            }
        }
        Ok(Status::Solved)
    };
    // SAFETY: the header's rules.
    unsafe { with_distributor(distributor, message, message_size, body) }
}

/// Goes on with other upper bounds of the normal forces, in N; zero switches a contact off. A contact fades in or out
/// where its limit changes a little at each tick. On an error nothing changes. For the control loop: see there.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gf_distributor_set_limits(
    distributor: *mut Distributor,
    max_normal_force: *const f64,
    num_contacts: usize,
    message: *mut c_char,
    message_size: usize,
) -> Status {
    let body = |control: &mut dyn ControlLoop| {
        // SAFETY: the header's rules.
        control.set_limits(unsafe { required("max_normal_force", max_normal_force, num_contacts) }?)?;
        Ok(Status::Solved)
    };
    // SAFETY: the header's rules.
    unsafe { with_distributor(distributor, message, message_size, body) }
}

/// Goes on with another grasp, which it copies: contacts have rolled or slid, or there are more or fewer of them. On an
/// error nothing changes. Limits are those of the grasp. For the control loop: see there.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gf_distributor_update(
    distributor: *mut Distributor,
    grasp: *const Grasp,
    message: *mut c_char,
    message_size: usize,
) -> Status {
    let body = |control: &mut dyn ControlLoop| {
        // SAFETY: the header's rules.
        control.update(unsafe { borrowed(grasp) }?)?;
        Ok(Status::Solved)
    };
    // SAFETY: the header's rules.
    unsafe { with_distributor(distributor, message, message_size, body) }
}

/// The same from arrays, so that not even the grasp takes memory from the system. `options` may be NULL for the
/// defaults. For the control loop: see there.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gf_distributor_update_contacts(
    distributor: *mut Distributor,
    contacts: *const Contacts,
    options: *const GraspOptions,
    message: *mut c_char,
    message_size: usize,
) -> Status {
    let body = |control: &mut dyn ControlLoop| {
        // SAFETY: the header's rules.
        control.update(&unsafe { AnyGrasp::new(contacts, options) }?)?;
        Ok(Status::Solved)
    };
    // SAFETY: the header's rules.
    unsafe { with_distributor(distributor, message, message_size, body) }
}

/// Forgets earlier wrenches, so that the next solve starts from nothing. The answers do not change.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gf_distributor_forget(distributor: *mut Distributor) -> Status {
    let body = |control: &mut dyn ControlLoop| {
        control.forget();
        Ok(Status::Solved)
    };
    // SAFETY: no buffer, and the header's rules.
    unsafe { with_distributor(distributor, ptr::null_mut(), 0, body) }
}
