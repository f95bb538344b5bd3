//! The memory of a distributor, so that its calls take none from the system.
//!
//! A [`Heap`] holds all that a distributor owns. Blocks come in sizes of powers of two; a block that is given back waits
//! in the list of its size. Taking and giving back are a few instructions each, without lock or search. The heap is
//! made larger than the distributor needs; should it still be too small, it takes one more chunk from the system.
//!
//! [`Heap::scope`] makes this the memory of all that its thread allocates. What is allocated in a scope must be dropped
//! in a scope of the same heap: [`crate::distributor`] makes, uses and drops a distributor in scopes of its heap.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::ptr;

/// Blocks are aligned by this; stricter ones, which nobody asks for, come from the system.
const ALIGNMENT: usize = 64;

/// The smallest block, `2^4` bytes.
const SMALLEST: u32 = 4;

/// Each chunk is as large as all before it together, so that this many never run out.
const CHUNKS: usize = 40;

/// The first chunk, in bytes.
const FIRST_CHUNK: usize = 1 << 18;

#[derive(Clone, Copy)]
struct Chunk {
    start: *mut u8,
    bytes: usize,
}

/// A block in the list of its size.
struct Free {
    next: *mut Free,
}

/// Memory with lists of free blocks by size.
pub(crate) struct Heap {
    chunks: [Chunk; CHUNKS],
    count: usize,
    /// What was never handed out of the last chunk.
    fresh: Chunk,
    free: [*mut Free; usize::BITS as usize],
    /// Bytes of the blocks in use.
    used: usize,
}

thread_local! {
    static CURRENT: Cell<*mut Heap> = const { Cell::new(ptr::null_mut()) };
}

/// While it lives, its thread allocates in a heap.
pub(crate) struct Scope {
    before: *mut Heap,
}

impl Drop for Scope {
    fn drop(&mut self) {
        CURRENT.set(self.before);
    }
}

impl Heap {
    /// A heap that takes memory from the system when it is first asked for some.
    pub(crate) fn new() -> Self {
        let none = Chunk { start: ptr::null_mut(), bytes: 0 };
        Self {
            chunks: [none; CHUNKS],
            count: 0,
            fresh: none,
            free: [ptr::null_mut(); usize::BITS as usize],
            used: 0,
        }
    }

    /// Makes this the heap of the thread.
    ///
    /// # Safety
    ///
    /// The heap outlives the scope, and no other thread uses it meanwhile. What is allocated in the scope is dropped in
    /// a scope of the same heap, and before the heap.
    pub(crate) unsafe fn scope(heap: *mut Self) -> Scope {
        Scope { before: CURRENT.replace(heap) }
    }

    /// Bytes of the blocks in use.
    pub(crate) fn used(&self) -> usize {
        self.used
    }

    /// Makes room for `bytes` more; false where the system has none.
    pub(crate) fn reserve(&mut self, bytes: usize) -> bool {
        self.fresh.bytes >= bytes || self.grow(bytes)
    }

    fn allocate(&mut self, layout: Layout) -> *mut u8 {
        let Some((class, bytes)) = block(layout) else { return ptr::null_mut() };
        let head = self.free[class];
        if !head.is_null() {
            // SAFETY: `head` was given back, so it is a block of this heap that nobody else uses, and holds its list's
            // next block.
            self.free[class] = unsafe { (*head).next };
            self.used += bytes;
            return head.cast();
        }
        let spacing = bytes.max(ALIGNMENT);
        if self.fresh.bytes < spacing && !self.grow(spacing) {
            return ptr::null_mut();
        }
        let start = self.fresh.start;
        // SAFETY: `fresh` has at least `spacing` bytes.
        self.fresh = Chunk { start: unsafe { start.add(spacing) }, bytes: self.fresh.bytes - spacing };
        self.used += bytes;
        start
    }

    fn release(&mut self, pointer: *mut u8, layout: Layout) {
        if let Some((class, bytes)) = block(layout) {
            #[allow(clippy::cast_ptr_alignment, reason = "blocks are aligned")]
            let freed = pointer.cast::<Free>();
            // SAFETY: the block is this heap's, nobody uses it any more, and it is aligned and large enough for a pointer.
            unsafe { freed.write(Free { next: self.free[class] }) };
            self.free[class] = freed;
            self.used -= bytes;
        }
    }

    /// Takes a chunk of at least `bytes` from the system, and touches it, so that its pages are there.
    #[cold]
    fn grow(&mut self, bytes: usize) -> bool {
        let all: usize = self.chunks[..self.count].iter().map(|chunk| chunk.bytes).sum();
        let Some(bytes) = bytes.max(all).max(FIRST_CHUNK).checked_next_multiple_of(ALIGNMENT) else {
            return false;
        };
        let Ok(layout) = Layout::from_size_align(bytes, ALIGNMENT) else { return false };
        if self.count == CHUNKS {
            return false;
        }
        // SAFETY: the layout is not empty.
        let start = unsafe { System.alloc(layout) };
        if start.is_null() {
            return false;
        }
        // SAFETY: the chunk has this many bytes.
        unsafe { start.write_bytes(0, bytes) };
        self.fresh = Chunk { start, bytes };
        self.chunks[self.count] = self.fresh;
        self.count += 1;
        true
    }

    fn owns(&self, pointer: *mut u8) -> bool {
        let address = pointer.addr();
        self.chunks[..self.count].iter().any(|chunk| address.wrapping_sub(chunk.start.addr()) < chunk.bytes)
    }
}

impl Drop for Heap {
    fn drop(&mut self) {
        // A block that is still in use, against the rule of `scope`, is leaked rather than left without memory.
        if self.used == 0 {
            for chunk in &self.chunks[..self.count] {
                // SAFETY: `grow` allocated the chunk with this layout, and none of its blocks is in use.
                unsafe {
                    System.dealloc(chunk.start, Layout::from_size_align_unchecked(chunk.bytes, ALIGNMENT));
                };
            }
        }
    }
}

/// The list of a block and its bytes; `None` where no heap holds such blocks.
fn block(layout: Layout) -> Option<(usize, usize)> {
    let bytes = layout.size().max(layout.align()).max(1 << SMALLEST).checked_next_power_of_two()?;
    (layout.align() <= ALIGNMENT).then_some((bytes.trailing_zeros() as usize, bytes))
}

/// The allocator of the library: the heap of the scope, or else the system.
struct Allocator;

#[global_allocator]
static ALLOCATOR: Allocator = Allocator;

// SAFETY: a pointer that is released or resized goes back to where it came from: to the heap that owns it, or else to the
// system. By the rule of `Heap::scope` blocks of a heap are released in its scopes only. Neither panics.
unsafe impl GlobalAlloc for Allocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let heap = CURRENT.get();
        if heap.is_null() || layout.align() > ALIGNMENT {
            // SAFETY: the caller's promise is the system's requirement.
            return unsafe { System.alloc(layout) };
        }
        // SAFETY: the heap outlives its scope, and only this thread uses it.
        unsafe { (*heap).allocate(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        let heap = CURRENT.get();
        // SAFETY: the heap outlives its scope, and only this thread uses it. What it does not own is the system's.
        unsafe {
            if !heap.is_null() && (*heap).owns(pointer) {
                (*heap).release(pointer, layout);
            } else {
                System.dealloc(pointer, layout);
            }
        }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        let heap = CURRENT.get();
        // SAFETY: as in `dealloc`; the caller promises that `size` makes a valid layout.
        unsafe {
            if heap.is_null() || !(*heap).owns(pointer) {
                return System.realloc(pointer, layout, size);
            }
            let larger = Layout::from_size_align_unchecked(size, layout.align());
            if block(larger) == block(layout) {
                return pointer;
            }
            let moved = (*heap).allocate(larger);
            if !moved.is_null() {
                moved.copy_from_nonoverlapping(pointer, layout.size().min(size));
                (*heap).release(pointer, layout);
            }
            moved
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{ALIGNMENT, FIRST_CHUNK, Heap};
    use std::alloc::Layout;

    #[test]
    fn blocks_in_use_do_not_meet_and_memory_is_used_again() {
        let mut heap = Heap::new();
        let mut live: Vec<(*mut u8, Layout, u8)> = Vec::new();
        let mut state = 1_u64;
        for step in 0..20_000_u32 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let draw = (state >> 33) as usize;
            if draw.is_multiple_of(2) || live.len() > 100 {
                if let Some((pointer, layout, mark)) =
                    (!live.is_empty()).then(|| live.swap_remove(draw % live.len()))
                {
                    // SAFETY: the block has this many bytes, which were written below.
                    let bytes = unsafe { std::slice::from_raw_parts(pointer, layout.size()) };
                    assert!(bytes.iter().all(|&byte| byte == mark));
                    heap.release(pointer, layout);
                }
            } else {
                let layout = Layout::from_size_align(draw % 3000 + 1, 1 << (draw % 7)).unwrap();
                let (pointer, mark) = (heap.allocate(layout), step as u8);
                assert_eq!(pointer.addr() % layout.align().min(ALIGNMENT), 0);
                // SAFETY: the block has this many bytes.
                unsafe { pointer.write_bytes(mark, layout.size()) };
                live.push((pointer, layout, mark));
            }
        }
        for (pointer, layout, _) in live {
            heap.release(pointer, layout);
        }
        assert_eq!(heap.used(), 0);
        // At most 101 blocks of at most 4096 bytes at once, of nine sizes.
        assert!(heap.chunks.iter().map(|chunk| chunk.bytes).sum::<usize>() <= 4 * FIRST_CHUNK);
    }
}
