//! What is left when the crate is built without Aravis.
#![cfg(not(feature = "aravis"))]

use camera_aravis::{AravisCamera, CameraConfig, list_cameras};
use devices::{Camera, CameraError, CameraLink};

#[tokio::test]
async fn a_camera_says_that_it_needs_aravis() {
    let camera = AravisCamera::open(CameraConfig::new("127.0.0.2"));
    let reason = match &*camera.link().borrow() {
        CameraLink::Lost { reason } => reason.clone(),
        link @ CameraLink::Open { .. } => panic!("{link:?}"),
    };
    assert!(reason.contains("built without Aravis"), "{reason}");
    let refused = camera.arm(1).await.unwrap_err();
    assert!(matches!(refused, CameraError::Lost { .. }), "{refused}");
    assert!(list_cameras().unwrap_err().to_string().contains("built without Aravis"));
}
