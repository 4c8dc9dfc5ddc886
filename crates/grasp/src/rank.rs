//! Which grasp first, and which are the same.

use crate::cup::Cup;
use crate::result::Grasp;

/// Normals of one grasp found twice differ by less, radians.
const SAME_ANGLE: f64 = 0.35;

/// Best first; of grasps less than a cup's radius apart the best stays. Equal totals are ordered by place.
pub(crate) fn ranked(mut grasps: Vec<Grasp>, cup: &Cup) -> Vec<Grasp> {
    let place = |grasp: &Grasp| (grasp.contact.x, grasp.contact.y, grasp.contact.z);
    grasps.sort_by(|a, b| {
        let ((ax, ay, az), (bx, by, bz)) = (place(a), place(b));
        let by_place = ax.total_cmp(&bx).then(ay.total_cmp(&by)).then(az.total_cmp(&bz));
        b.total.total_cmp(&a.total).then(by_place)
    });
    let mut kept: Vec<Grasp> = Vec::new();
    for grasp in grasps {
        let is_same = |other: &Grasp| {
            (other.contact - grasp.contact).norm() < cup.radius() && other.normal.dot(&grasp.normal) > SAME_ANGLE.cos()
        };
        if !kept.iter().any(is_same) {
            kept.push(grasp);
        }
    }
    kept
}
