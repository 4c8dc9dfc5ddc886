//! What is known of the xArm7's links: of each a box and a capsule that hold all of its shape, and its joints' axes.

#![allow(dead_code)]

/// Millimetres, in the link's frame.
pub(crate) struct Known {
    pub(crate) link: &'static str,
    pub(crate) core: [[f64; 3]; 2],
    pub(crate) radius: f64,
    /// Radius of its joints' housings.
    pub(crate) housing: f64,
    /// How far the shape is taken to reach from the joints' axes, and from the capsule's core.
    pub(crate) around: [f64; 2],
    pub(crate) low: [f64; 3],
    pub(crate) high: [f64; 3],
    /// A point on each joint's axis, and the axis: 1 for y, 2 for z.
    pub(crate) axes: &'static [([f64; 3], usize)],
    /// Where neighbours go on: a point, the axis with its sign, radius and length of a cylinder.
    pub(crate) ends: &'static [([f64; 3], usize, f64, f64, f64)],
}

const O: [f64; 3] = [0.0; 3];

#[rustfmt::skip]
pub(crate) const LINKS: [Known; 8] = [
    Known { link: "link_base", core: [[0.0, 0.0, 89.0], [-13.0, 3.0, 30.0]], radius: 81.0, housing: 42.0, around: [49.0, 50.0], low: [-92.0, -63.0, 0.0], high: [63.0, 63.0, 155.0], axes: &[(O, 2)], ends: &[] },
    Known { link: "link1", core: [[0.0, 0.0, -54.0], [0.0, 17.0, 0.0]], radius: 75.0, housing: 42.0, around: [49.0, 50.0], low: [-48.0, -57.0, -112.0], high: [48.0, 75.0, 48.0], axes: &[(O, 1), (O, 2)],
        ends: &[([0.0, 0.0, -112.0], 2, -1.0, 50.0, 44.0), ([0.0, 75.0, 0.0], 1, 1.0, 50.0, 44.0)] },
    Known { link: "link2", core: [[0.0, -32.0, 81.0], [0.0, -140.0, 19.0]], radius: 80.0, housing: 42.0, around: [49.0, 50.0], low: [-48.0, -192.0, -42.0], high: [47.0, 47.0, 119.0], axes: &[(O, 1), (O, 2)],
        ends: &[([0.0, 0.0, 75.0], 2, -1.0, 50.0, 120.0), ([0.0, -192.0, 0.0], 1, -1.0, 50.0, 44.0)] },
    Known { link: "link3", core: [[8.0, 1.0, -44.0], [51.0, -4.0, 0.0]], radius: 76.0, housing: 42.0, around: [49.0, 50.0], low: [-42.0, -67.0, -101.0], high: [95.0, 69.0, 43.0], axes: &[([52.5, 0.0, 0.0], 1), (O, 2)],
        ends: &[([0.0, 0.0, -101.0], 2, -1.0, 50.0, 44.0), ([52.5, -67.0, 0.0], 1, -1.0, 50.0, 40.0)] },
    Known { link: "link4", core: [[27.0, -16.0, 78.0], [87.0, -120.0, 11.0]], radius: 75.0, housing: 42.0, around: [49.0, 50.0], low: [-43.0, -169.0, -42.0], high: [120.0, 43.0, 107.0], axes: &[([77.5, 0.0, 0.0], 1), (O, 2)],
        ends: &[([0.0, 0.0, 68.0], 2, -1.0, 50.0, 130.0), ([77.5, -169.0, 0.0], 1, -1.0, 45.0, 44.0)] },
    Known { link: "link5", core: [[-1.0, 9.0, -153.0], [0.0, 46.0, 0.0]], radius: 56.0, housing: 42.0, around: [49.0, 50.0], low: [-42.0, -43.0, -173.0], high: [42.0, 86.0, 38.0], axes: &[(O, 1), (O, 2)], ends: &[] },
    Known { link: "link6", core: [[76.0, 21.0, 0.0], [18.0, 5.0, 18.0]], radius: 61.0, housing: 37.0, around: [39.0, 42.0], low: [-37.0, -38.0, -37.0], high: [113.0, 69.0, 58.0], axes: &[([76.0, 0.0, 0.0], 1), (O, 2)],
        ends: &[([0.0, 0.0, 43.0], 2, -1.0, 40.0, 80.0), ([76.0, 69.0, 0.0], 1, 1.0, 40.0, 28.0)] },
    Known { link: "link7", core: [[0.0, 0.0, -14.0], [0.0, -13.0, -14.0]], radius: 40.0, housing: 37.0, around: [49.0, 50.0], low: [-37.0, -52.0, -28.0], high: [37.0, 37.0, 0.0], axes: &[(O, 2)], ends: &[] },
];
