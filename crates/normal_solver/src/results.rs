//! What is published of a solved capture. Only what somebody reads is made.

use imaging::{Image, Pixel};
use interfaces::ByteSequence;
use interfaces::sensor_msgs::msg::{CompressedImage, Image as ImageMessage, PointCloud2, PointField};
use interfaces::std_msgs::msg::Header;
use photometric::{EdgeMap, NormalSolution, SurfacePoint, surface_points};
use ros::{Node, Publisher, Qos};

use crate::convert;
use crate::error::Error;
use crate::near_field::Solved;

/// The topics of one camera.
pub(crate) struct Results {
    normals: Publisher<ImageMessage>,
    normals_preview: Publisher<CompressedImage>,
    confidence: Publisher<ImageMessage>,
    mask: Publisher<ImageMessage>,
    depth: Publisher<ImageMessage>,
    edges: Publisher<ImageMessage>,
    edge_confidence: Publisher<ImageMessage>,
    edges_preview: Publisher<CompressedImage>,
    points: Publisher<PointCloud2>,
}

impl Results {
    pub(crate) fn new(node: &Node, camera: &str) -> Result<Self, Error> {
        let image = |what: &str| node.publisher(&format!("{camera}/{what}"), Qos::MAP);
        let picture = |what: &str| node.publisher(&format!("{camera}/{what}/preview"), Qos::MAP);
        Ok(Self {
            normals: image("normals")?,
            normals_preview: picture("normals")?,
            confidence: image("confidence")?,
            mask: image("mask")?,
            depth: image("depth")?,
            edges: image("edges")?,
            edge_confidence: image("edge_confidence")?,
            edges_preview: picture("edges")?,
            points: node.publisher(&format!("{camera}/points"), Qos::MAP)?,
        })
    }

    /// Normals alone, as distant lights give them.
    pub(crate) fn publish_normals(&self, header: Header, normals: Image<[f32; 3]>) -> Result<(), Error> {
        if self.normals_preview.subscription_count() > 0 {
            self.normals_preview
                .publish(convert::preview(header.clone(), &normals)?)?;
        }
        self.normals.publish(convert::normal_message(header, normals))?;
        Ok(())
    }

    /// Everything that calibrated panels give.
    pub(crate) fn publish(&self, header: Header, solved: Solved) -> Result<(), Error> {
        let solution = solved.solution;
        if self.points.subscription_count() > 0 {
            let (view, rays) = (&solved.view, &solved.rays.1);
            let points = surface_points(&solution.depth.depth, &solution.normals.normals, view, rays);
            self.points.publish(cloud(header.clone(), &points))?;
        }
        let EdgeMap { edges, confidence, .. } = solution.edges;
        if self.edges_preview.subscription_count() > 0 {
            self.edges_preview
                .publish(convert::gray_preview(header.clone(), edges.as_image())?)?;
        }
        self.edges
            .publish(image_message(header.clone(), "mono8", edges.as_image().clone()))?;
        self.edge_confidence
            .publish(image_message(header.clone(), "32FC1", confidence))?;
        self.depth
            .publish(image_message(header.clone(), "32FC1", solution.depth.depth))?;
        let NormalSolution {
            normals,
            confidence,
            mask,
            ..
        } = solution.normals;
        self.confidence
            .publish(image_message(header.clone(), "32FC1", confidence))?;
        self.mask
            .publish(image_message(header.clone(), "mono8", mask.as_image().clone()))?;
        self.publish_normals(header, normals)
    }
}

/// The pixels are handed over, not copied.
fn image_message<T: Pixel>(header: Header, encoding: &str, image: Image<T>) -> ImageMessage {
    let (width, height) = (image.width() as u32, image.height() as u32);
    ImageMessage {
        header,
        height,
        width,
        encoding: encoding.into(),
        is_bigendian: u8::from(cfg!(target_endian = "big")),
        step: width * size_of::<T>() as u32,
        data: ByteSequence::from_owner(image),
    }
}

/// Six 32-bit numbers a point: position and normal in the frame of the header.
fn cloud(header: Header, points: &[SurfacePoint]) -> PointCloud2 {
    const NAMES: [&str; 6] = ["x", "y", "z", "normal_x", "normal_y", "normal_z"];
    const FLOAT32: u8 = 7;
    let number_bytes = size_of::<f32>() as u32;
    let field = |(position, name): (u32, &str)| PointField {
        name: name.to_owned(),
        offset: position * number_bytes,
        datatype: FLOAT32,
        count: 1,
    };
    let numbers = points
        .iter()
        .flat_map(|point| point.position.into_iter().chain(point.normal));
    let data: Vec<u8> = numbers.flat_map(f32::to_ne_bytes).collect();
    let point_step = NAMES.len() as u32 * number_bytes;
    PointCloud2 {
        header,
        height: 1,
        width: points.len() as u32,
        fields: (0..).zip(NAMES).map(field).collect(),
        is_bigendian: cfg!(target_endian = "big"),
        point_step,
        row_step: point_step * points.len() as u32,
        data: data.into(),
        is_dense: false,
    }
}
