//! The pixels of a mask, one behind the other, and who is next to whom.

use imaging::Mask;

/// Marks a pixel outside the mask.
const NONE: u32 = u32::MAX;

/// Pixels of a mask in the order of their rows; a pixel's place among them is its slot.
pub(crate) struct Pixels {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Position in the image, slot by slot.
    pub(crate) inside: Vec<u32>,
    slots: Vec<u32>,
}

impl Pixels {
    pub(crate) fn new(mask: &Mask) -> Self {
        let image = mask.as_image();
        let mut slots = vec![NONE; image.pixels().len()];
        let mut inside = Vec::with_capacity(slots.len());
        for (index, (&value, slot)) in image.pixels().iter().zip(&mut slots).enumerate() {
            if value != 0 {
                *slot = inside.len() as u32;
                inside.push(index as u32);
            }
        }
        Self {
            width: image.width(),
            height: image.height(),
            inside,
            slots,
        }
    }

    /// The slot of a pixel; none outside the mask and the image.
    #[inline]
    pub(crate) fn slot(&self, x: usize, y: usize) -> Option<usize> {
        if x >= self.width || y >= self.height {
            return None;
        }
        let slot = self.slots[y * self.width + x];
        (slot != NONE).then_some(slot as usize)
    }

    /// Column and row.
    #[inline]
    pub(crate) fn place(&self, index: u32) -> (usize, usize) {
        let index = index as usize;
        (index % self.width, index / self.width)
    }

    /// Slots of the neighbours on the left, on the right, above and below; none outside the mask and the image.
    #[inline]
    pub(crate) fn neighbours(&self, index: u32) -> [Option<usize>; 4] {
        let (x, y) = self.place(index);
        [
            self.slot(x.wrapping_sub(1), y),
            self.slot(x + 1, y),
            self.slot(x, y.wrapping_sub(1)),
            self.slot(x, y + 1),
        ]
    }
}
