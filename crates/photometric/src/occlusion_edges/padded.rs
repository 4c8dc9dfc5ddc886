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

    /// Whether a place is not on the border.
    pub(super) fn is_in_image(&self, index: usize) -> bool {
        let (column, row) = (index % self.stride(), index / self.stride());
        (1..=self.width).contains(&column) && (1..=self.height).contains(&row)
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
}
