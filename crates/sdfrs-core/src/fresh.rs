//! Memory that is filled piece by piece, each by the thread that goes on to work there: what was filled just now is
//! near, what was filled long ago has to come back.

use std::{
    mem::MaybeUninit,
    sync::atomic::{AtomicUsize, Ordering},
};

use rayon::prelude::*;

use crate::pages;

/// A vector in the making.
pub struct Fresh<V> {
    /// Room for `n` values, and none of them.
    memory: Vec<V>,
    n: usize,
    filled: AtomicUsize,
}

impl<V: Copy + Send> Fresh<V> {
    /// Asks for memory, and leaves it as it is.
    pub fn new(n: usize) -> Self {
        Self { memory: pages::room(n), n, filled: AtomicUsize::new(0) }
    }

    /// All of it, in pieces of `size` values (the last may be shorter), each to be filled.
    pub fn pieces(&mut self, size: usize) -> impl IndexedParallelIterator<Item = Piece<'_, V>> {
        // What earlier pieces held is forgotten: these are all of it.
        *self.filled.get_mut() = 0;
        let (room, filled) = (&mut self.memory.spare_capacity_mut()[..self.n], &self.filled);
        room.par_chunks_mut(size).map(move |room| Piece { room, filled })
    }

    /// The vector.
    ///
    /// # Panics
    /// Where a piece was not filled.
    #[allow(unsafe_code)]
    pub fn done(mut self) -> Vec<V> {
        assert_eq!(*self.filled.get_mut(), self.n, "a piece was not filled");
        // SAFETY: pieces share no place, each counts its values when it is filled and can be filled but once, and the
        // count began when the last ones were handed out: at `n`, each of the first `n` places holds a value.
        unsafe { self.memory.set_len(self.n) };
        self.memory
    }
}

/// A part of a [`Fresh`].
pub struct Piece<'a, V> {
    room: &'a mut [MaybeUninit<V>],
    filled: &'a AtomicUsize,
}

impl<'a, V: Copy> Piece<'a, V> {
    /// Fills it with a value.
    pub fn fill(self, value: V) -> &'a mut [V] {
        // Whole runs are copied faster than values of an odd size are written.
        let run = [MaybeUninit::new(value); 64];
        self.room.chunks_mut(run.len()).for_each(|room| room.copy_from_slice(&run[..room.len()]));
        self.full()
    }

    /// Every place was written.
    #[allow(unsafe_code)]
    fn full(self) -> &'a mut [V] {
        self.filled.fetch_add(self.room.len(), Ordering::Relaxed);
        let Self { room, .. } = self;
        // SAFETY: called only where every place has been written to; a value lies in memory as its room does.
        unsafe { &mut *(std::ptr::from_mut(room) as *mut [V]) }
    }
}

impl<'a, const N: usize> Piece<'a, [f32; N]> {
    /// Fills it with zeros, a quarter of the time: processors clear whole lines without reading them first.
    #[allow(unsafe_code)]
    pub fn clear(self) -> &'a mut [[f32; N]] {
        // SAFETY: the room is as long as it says, and a number whose bytes are all 0 is 0.
        unsafe { self.room.as_mut_ptr().write_bytes(0, self.room.len()) };
        self.full()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_make_one_vector() {
        for (n, size) in [(0, 3), (1, 3), (3, 3), (1000, 7)] {
            let mut fresh = Fresh::new(n);
            fresh.pieces(size).enumerate().for_each(|(i, piece)| {
                for (k, v) in piece.fill(5).iter_mut().enumerate() {
                    assert_eq!(*v, 5);
                    *v = i * size + k;
                }
            });
            assert!(fresh.done().into_iter().eq(0..n));
        }
    }

    #[test]
    fn what_is_cleared_is_zero_also_where_something_was() {
        for _ in 0..3 {
            let mut fresh = Fresh::<[f32; 3]>::new(1000);
            fresh.pieces(300).for_each(|piece| {
                for v in piece.clear() {
                    assert_eq!(*v, [0.0; 3]);
                    *v = [1.0; 3];
                }
            });
            assert!(fresh.done() == [[1.0; 3]; 1000]);
        }
    }

    #[test]
    #[should_panic(expected = "a piece was not filled")]
    fn a_piece_left_out_is_noticed_though_another_was_filled_twice() {
        let mut fresh = Fresh::new(10);
        for _ in 0..2 {
            fresh.pieces(5).enumerate().filter(|(i, _)| *i == 0).for_each(|(_, piece)| {
                piece.fill(1);
            });
        }
        fresh.done();
    }
}
