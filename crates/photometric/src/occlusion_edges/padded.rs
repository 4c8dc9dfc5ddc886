//! Bytes with a border all around, so that every pixel has eight neighbours.

/// An image of bytes with a border of one pixel of zeros.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Padded {
    width: usize,
    height: usize,
    pub(super) bytes: Vec<u8>,
}

impl Padded {
    /// All zeros; the size is that without the border.
    pub(super) fn zeros(width: usize, height: usize) -> Self {
        Self {
            width,
            height,
            bytes: vec![0; (width + 2) * (height + 2)],
        }
    }

    /// Columns without the border.
    pub(super) fn width(&self) -> usize {
        self.width
    }

    /// Rows without the border.
    pub(super) fn height(&self) -> usize {
        self.height
    }

    /// Length of a row with the border.
    pub(super) fn stride(&self) -> usize {
        self.width + 2
    }

    /// Where a pixel is among the bytes.
    pub(super) fn index(&self, x: usize, y: usize) -> usize {
        (y + 1) * self.stride() + x + 1
    }

    /// Column and row of a pixel of the image, by its place among the bytes.
    pub(super) fn place(&self, index: usize) -> (usize, usize) {
        (index % self.stride() - 1, index / self.stride() - 1)
    }

    /// Gives the whole border one value.
    pub(super) fn fill_border(&mut self, value: u8) {
        let (stride, last) = (self.stride(), self.bytes.len() - self.stride());
        self.bytes[..stride].fill(value);
        self.bytes[last..].fill(value);
        for row in self.bytes.chunks_exact_mut(stride) {
            row[0] = value;
            row[stride - 1] = value;
        }
    }

    /// A row without its border.
    pub(super) fn row(&self, y: usize) -> &[u8] {
        let start = self.index(0, y);
        &self.bytes[start..start + self.width]
    }

    /// All rows, each with its border.
    pub(super) fn bordered_rows_mut(&mut self) -> &mut [u8] {
        let stride = self.stride();
        let end = self.bytes.len() - stride;
        &mut self.bytes[stride..end]
    }

    /// Places of a pixel's neighbours, clockwise from the one above.
    pub(super) fn around(&self, index: usize) -> [usize; 8] {
        let stride = self.stride();
        let (above, below) = (index - stride, index + stride);
        [
            above,
            above + 1,
            index + 1,
            below + 1,
            below,
            below - 1,
            index - 1,
            above - 1,
        ]
    }

    /// Which of a pixel's neighbours are 1, of zeros and ones: bit i for the i-th of [`Self::around`].
    pub(super) fn pattern(&self, index: usize) -> usize {
        let three = |middle: usize| &self.bytes[middle - 1..=middle + 1];
        let (above, here, below) = (three(index - self.stride()), three(index), three(index + self.stride()));
        let clockwise = [
            above[1], above[2], here[2], below[2], below[1], below[0], here[0], above[0],
        ];
        let bits = clockwise.iter().enumerate();
        bits.fold(0, |pattern, (bit, &inside)| pattern | usize::from(inside) << bit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns_are_read_clockwise_from_above() {
        let mut image = Padded::zeros(3, 3);
        let middle = image.index(1, 1);
        for (bit, neighbour) in image.around(middle).into_iter().enumerate() {
            image.bytes.fill(0);
            image.bytes[neighbour] = 1;
            assert_eq!(image.pattern(middle), 1 << bit);
        }
        assert_eq!(image.place(middle), (1, 1));
    }
}
