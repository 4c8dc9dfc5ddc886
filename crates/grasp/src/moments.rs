//! Moments of a likelihood image over any upright window, at the cost of four look-ups.

/// Sums of weight times 1, x, y, x², xy and y².
pub(crate) type Sums = [f64; 6];

/// Integral images of the moments up to the second (Viola and Jones, CVPR 2001, for the idea).
#[derive(Debug)]
pub(crate) struct Moments {
    width: usize,
    height: usize,
    /// One row and one column more than the image.
    integral: Vec<Sums>,
}

/// First and one past the last column and row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bounds {
    pub(crate) left: usize,
    pub(crate) right: usize,
    pub(crate) top: usize,
    pub(crate) bottom: usize,
}

impl Moments {
    pub(crate) fn new(width: usize, weights: &[f32]) -> Self {
        let height = weights.len().checked_div(width).unwrap_or(0);
        let stride = width + 1;
        let mut integral = vec![[0.0; 6]; stride * (height + 1)];
        for y in 0..height {
            let mut row = [0.0; 6];
            for x in 0..width {
                let weight = f64::from(weights[y * width + x]);
                if weight > 0.0 {
                    add(&mut row, &products(weight, x as f64, y as f64));
                }
                let mut sums = integral[y * stride + x + 1];
                add(&mut sums, &row);
                integral[(y + 1) * stride + x + 1] = sums;
            }
        }
        Self {
            width,
            height,
            integral,
        }
    }

    /// Cells within half sizes of a position.
    pub(crate) fn bounds(&self, middle: [f64; 2], half: [f64; 2]) -> Bounds {
        let first = |middle: f64, half: f64, size: usize| ((middle - half).ceil().max(0.0) as usize).min(size);
        let last =
            |middle: f64, half: f64, size: usize| ((middle + half).floor() + 1.0).clamp(0.0, size as f64) as usize;
        let (left, top) = (
            first(middle[0], half[0], self.width),
            first(middle[1], half[1], self.height),
        );
        Bounds {
            left,
            right: last(middle[0], half[0], self.width).max(left),
            top,
            bottom: last(middle[1], half[1], self.height).max(top),
        }
    }

    pub(crate) fn sums(&self, bounds: &Bounds) -> Sums {
        let stride = self.width + 1;
        let at = |x: usize, y: usize| &self.integral[y * stride + x];
        let (a, b) = (at(bounds.left, bounds.top), at(bounds.right, bounds.top));
        let (c, d) = (at(bounds.left, bounds.bottom), at(bounds.right, bounds.bottom));
        std::array::from_fn(|k| d[k] - c[k] - b[k] + a[k])
    }

    pub(crate) fn size(&self) -> [usize; 2] {
        [self.width, self.height]
    }
}

pub(crate) fn products(weight: f64, x: f64, y: f64) -> Sums {
    let (wx, wy) = (weight * x, weight * y);
    [weight, wx, wy, wx * x, wx * y, wy * y]
}

pub(crate) fn add(sums: &mut Sums, more: &Sums) {
    for (sum, more) in sums.iter_mut().zip(more) {
        *sum += more;
    }
}

/// Middle and spread of a mass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Spread {
    pub(crate) mass: f64,
    pub(crate) middle: [f64; 2],
    /// Variance along x, covariance, variance along y.
    pub(crate) variance: [f64; 3],
}

impl Spread {
    /// None for an empty window.
    pub(crate) fn of(sums: &Sums) -> Option<Self> {
        let [mass, x, y, xx, xy, yy] = *sums;
        if mass <= 1e-9 {
            return None;
        }
        let (x, y) = (x / mass, y / mass);
        Some(Self {
            mass,
            middle: [x, y],
            variance: [
                (xx / mass - x * x).max(0.0),
                xy / mass - x * y,
                (yy / mass - y * y).max(0.0),
            ],
        })
    }

    /// Longer and shorter half axis of the evenly filled ellipse with this spread, and the angle of the longer one.
    pub(crate) fn ellipse(&self) -> ([f64; 2], f64) {
        let [xx, xy, yy] = self.variance;
        let mean = f64::midpoint(xx, yy);
        let difference = ((xx - yy) / 2.0).hypot(xy);
        let axis = |variance: f64| 2.0 * variance.max(0.0).sqrt();
        let angle = 0.5 * (2.0 * xy).atan2(xx - yy);
        ([axis(mean + difference), axis(mean - difference)], angle)
    }
}
