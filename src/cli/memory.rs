//! Where the program's memory comes from: large blocks lie on large pages.
//!
//! A page of 4 KiB costs the kernel two microseconds when it is first touched, ten times what filling it takes, and a program that draws
//! one picture touches thousands; of 2 MiB it hands out as many bytes in a twentieth of the time.

use rustix::mm::{self, Advice, MapFlags, MremapFlags, ProtFlags};
use std::alloc::{GlobalAlloc, Layout, System};
use std::ptr::null_mut;

/// Bytes from which on a block has pages of its own.
const LARGE: usize = 1 << 20;
/// Bytes of a large page.
const PAGE: usize = 2 << 20;

#[global_allocator]
static MEMORY: LargePages = LargePages;

/// The system's allocator, but for large blocks.
struct LargePages;

/// Bytes of the pages that hold a block; none for a small one, and for one that asks to lie rounder than small pages do.
fn pages(layout: Layout) -> Option<usize> {
    let large = layout.size() >= LARGE && layout.align() <= 4096;
    large.then(|| layout.size().next_multiple_of(PAGE))
}

/// The kernel may have no large pages left: then it gives small ones.
#[allow(unsafe_code)]
fn advise(block: *mut u8, bytes: usize) {
    // SAFETY: the pages are this block's, and the advice changes nothing that they hold.
    let _ = unsafe { mm::madvise(block.cast(), bytes, Advice::LinuxHugepage) };
}

// SAFETY: a block's pages follow from its layout alone, so that it goes back where it came from; fresh pages are zero.
#[allow(unsafe_code)]
unsafe impl GlobalAlloc for LargePages {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        if pages(layout).is_none() {
            // SAFETY: as the caller promises.
            return unsafe { System.alloc(layout) };
        }
        // SAFETY: as the caller promises.
        unsafe { self.alloc_zeroed(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        let Some(bytes) = pages(layout) else {
            // SAFETY: as the caller promises.
            return unsafe { System.alloc_zeroed(layout) };
        };
        let (access, flags) = (ProtFlags::READ | ProtFlags::WRITE, MapFlags::PRIVATE);
        // SAFETY: the kernel chooses a place where nothing is.
        let Ok(block) = (unsafe { mm::mmap_anonymous(null_mut(), bytes, access, flags) }) else {
            return null_mut();
        };
        advise(block.cast(), bytes);
        block.cast()
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        match pages(layout) {
            // SAFETY: the block has these pages for itself, and its owner is done with it.
            Some(bytes) => drop(unsafe { mm::munmap(block.cast(), bytes) }),
            // SAFETY: it came from there.
            None => unsafe { System.dealloc(block, layout) },
        }
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: as the caller promises.
        let wanted = unsafe { Layout::from_size_align_unchecked(size, layout.align()) };
        match (pages(layout), pages(wanted)) {
            // SAFETY: it came from there.
            (None, None) => unsafe { System.realloc(block, layout, size) },
            (Some(old), Some(new)) if old == new => block,
            (Some(old), Some(new)) => {
                // SAFETY: the block has these pages for itself; what it holds moves along with them.
                let moved = unsafe { mm::mremap(block.cast(), old, new, MremapFlags::MAYMOVE) };
                moved.map_or(null_mut(), |block| {
                    advise(block.cast(), new);
                    block.cast()
                })
            }
            _ => {
                // SAFETY: both blocks are as large as what is copied, and the old one is given back once.
                unsafe {
                    let fresh = self.alloc(wanted);
                    if !fresh.is_null() {
                        fresh.copy_from_nonoverlapping(block, layout.size().min(size));
                        self.dealloc(block, layout);
                    }
                    fresh
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn blocks_keep_what_they_hold_as_they_grow_and_shrink() {
        let mut list: Vec<u32> = (0..1000).collect();
        for megabytes in [2, 3, 9, 40, 5, 0] {
            list.resize((megabytes << 18).max(1000), 7);
            list.shrink_to_fit();
            assert!((0..1000).all(|i| list[i] == i as u32) && list[1000..].iter().all(|v| *v == 7));
        }
        let mut zeros = vec![0_u8; 5 << 20];
        assert!(zeros.iter().all(|v| *v == 0));
        zeros.fill(1);
        drop(zeros);
        assert!(vec![0_u8; 5 << 20].iter().all(|v| *v == 0));
    }
}
