//! The bag of results.

use std::path::Path;

use imaging::{Image, Pixel};
use interfaces::sensor_msgs::msg::Image as ImageMessage;
use interfaces::std_msgs::msg::Header;
use interfaces::{ByteSequence, Message, cdr};
use photometric::ViewSolution;
use recording::{BagWriter, OfferedQos, RecordingError};

use crate::captured::Captured;

pub(super) struct Output {
    bag: BagWriter,
}

impl Output {
    pub(super) fn create(folder: &Path) -> Result<Self, RecordingError> {
        Ok(Self {
            bag: BagWriter::create(folder)?,
        })
    }

    /// Writes a view's results, stamped like the capture's first image.
    pub(super) fn add(&mut self, captured: &Captured, solution: &ViewSolution) -> anyhow::Result<()> {
        let camera = &captured.camera;
        let header = &captured.header;
        let ViewSolution { normals, depth, edges } = solution;
        self.put(&format!("{camera}/normals"), "32FC3", header, &normals.normals)?;
        self.put(&format!("{camera}/depth"), "32FC1", header, &depth.depth)?;
        self.put(&format!("{camera}/edges"), "mono8", header, edges.edges.as_image())?;
        self.put(&format!("{camera}/edge_confidence"), "32FC1", header, &edges.confidence)?;
        self.put(&format!("{camera}/confidence"), "32FC1", header, &normals.confidence)?;
        self.put(&format!("{camera}/albedo"), "32FC1", header, &normals.albedo)?;
        self.put(&format!("{camera}/shadows"), "mono8", header, &normals.shadows)?;
        Ok(())
    }

    pub(super) fn finish(self) -> Result<(), RecordingError> {
        self.bag.finish()
    }

    fn put<T: Pixel>(&mut self, topic: &str, encoding: &str, header: &Header, image: &Image<T>) -> anyhow::Result<()> {
        let (width, height) = (image.width() as u32, image.height() as u32);
        let message = ImageMessage {
            header: header.clone(),
            height,
            width,
            encoding: encoding.to_owned(),
            is_bigendian: u8::from(cfg!(target_endian = "big")),
            step: width * size_of::<T>() as u32,
            data: ByteSequence::from(image.as_bytes()),
        };
        let qos = OfferedQos::default();
        let id = self
            .bag
            .add_topic(topic, ImageMessage::TYPE_NAME, ImageMessage::DEFINITION, &qos.into())?;
        let stamp = u64::try_from(header.stamp.to_nanos())?;
        Ok(self.bag.write(id, stamp, &cdr::to_vec(&message)?)?)
    }
}
