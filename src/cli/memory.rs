//! Where the program's memory comes from: large blocks of zeros are there when they are handed out.
//!
//! A page of 4 KiB costs the kernel a microsecond when it is first touched, ten times what filling it takes, and a program that draws one
//! picture touches thousands. Asked for together they cost a quarter on some machines, and nowhere more. (Pages of 2 MiB cost less still
//! where the machine has them at hand, and ten times as much where a virtual one must get them from its host first.)

use rustix::mm::{self, Advice};
use std::alloc::{GlobalAlloc, Layout, System};

/// Bytes from which on a block is worth asking for.
const LARGE: usize = 1 << 20;
/// Bytes of a page.
const PAGE: usize = 4096;

#[global_allocator]
static MEMORY: Memory = Memory;

/// The system's allocator.
struct Memory;

// SAFETY: every block comes from the system's allocator and goes back there.
#[allow(unsafe_code)]
unsafe impl GlobalAlloc for Memory {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as the caller promises.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as the caller promises.
        let block = unsafe { System.alloc_zeroed(layout) };
        if layout.size() >= LARGE && !block.is_null() {
            let first = block.wrapping_add(block.align_offset(PAGE));
            let bytes = (layout.size() - PAGE) & !(PAGE - 1);
            // SAFETY: the pages lie within the block, and what they hold stays; a kernel that cannot do it says so, and nothing is lost.
            let _ = unsafe { mm::madvise(first.cast(), bytes, Advice::LinuxPopulateWrite) };
        }
        block
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        // SAFETY: as the caller promises.
        unsafe { System.dealloc(block, layout) }
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: as the caller promises.
        unsafe { System.realloc(block, layout, size) }
    }
}
