//! Repeats every pixel, so that a small recording exercises everything at the sensor's full size.

use geometry::PinholeCamera;
use interfaces::sensor_msgs::msg::{CameraInfo, Image};

use crate::error::Error;

/// Every pixel `factor` times in both directions; row padding is dropped.
pub(crate) fn image(image: &Image, factor: usize) -> Result<Image, Error> {
    if factor == 1 {
        return Ok(image.clone());
    }
    let (width, height, step) = (image.width as usize, image.height as usize, image.step as usize);
    let pixel_bytes = pixel_bytes(&image.encoding)?;
    if step < width * pixel_bytes || image.data.len() < step * height {
        let (found, needed) = (image.data.len(), step.max(width * pixel_bytes) * height);
        return Err(Error::ImageSize {
            width,
            height,
            found,
            needed,
        });
    }
    let mut data = Vec::with_capacity(image.data.len() * factor * factor);
    for row in image.data.chunks_exact(step.max(1)).take(height) {
        let start = data.len();
        for pixel in row[..width * pixel_bytes].chunks_exact(pixel_bytes) {
            (0..factor).for_each(|_| data.extend_from_slice(pixel));
        }
        let end = data.len();
        (1..factor).for_each(|_| data.extend_from_within(start..end));
    }
    let scale = factor as u32;
    let (width, height) = (image.width * scale, image.height * scale);
    let step = width * pixel_bytes as u32;
    Ok(Image {
        width,
        height,
        step,
        data: data.into(),
        ..image.clone()
    })
}

/// The camera whose pixels are `factor` times smaller.
pub(crate) fn camera_info(info: &CameraInfo, factor: usize) -> Result<CameraInfo, Error> {
    if factor == 1 {
        return Ok(info.clone());
    }
    let (size, k) = ((info.width as usize, info.height as usize), &info.k);
    let camera = PinholeCamera::new(size.0, size.1, [k[0], k[4]], [k[2], k[5]])?.enlarged(factor)?;
    let mut enlarged = CameraInfo {
        width: camera.width() as u32,
        height: camera.height() as u32,
        ..info.clone()
    };
    let ([fx, fy], [cx, cy]) = (camera.focal(), camera.principal());
    (enlarged.k[0], enlarged.k[4], enlarged.k[2], enlarged.k[5]) = (fx, fy, cx, cy);
    (enlarged.p[0], enlarged.p[5], enlarged.p[2], enlarged.p[6]) = (fx, fy, cx, cy);
    Ok(enlarged)
}

fn pixel_bytes(encoding: &str) -> Result<usize, Error> {
    Ok(match encoding {
        "mono8" | "8UC1" => 1,
        "mono16" | "16UC1" => 2,
        "rgb8" | "bgr8" | "8UC3" => 3,
        "32FC1" => 4,
        "32FC3" => 12,
        _ => {
            return Err(Error::Encoding {
                found: encoding.to_owned(),
            });
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_repeated_and_padding_dropped() {
        let small = Image {
            width: 2,
            height: 1,
            step: 6,
            encoding: "mono16".into(),
            data: vec![1, 0, 2, 0, 9, 9].into(),
            ..Image::default()
        };
        let large = image(&small, 2).unwrap();
        assert_eq!((large.width, large.height, large.step), (4, 2, 8));
        assert_eq!(&large.data[..], [1, 0, 1, 0, 2, 0, 2, 0, 1, 0, 1, 0, 2, 0, 2, 0]);
    }

    #[test]
    fn the_camera_follows_its_pixels() {
        let mut info = CameraInfo {
            width: 2,
            height: 2,
            ..CameraInfo::default()
        };
        (info.k[0], info.k[4], info.k[2], info.k[5]) = (100.0, 100.0, 0.5, 0.5);
        let large = camera_info(&info, 3).unwrap();
        // The middle of 2 x 2 pixels is (0.5, 0.5); the middle of 6 x 6 is (2.5, 2.5).
        assert_eq!((large.width, large.k[0], large.k[2], large.p[6]), (6, 300.0, 2.5, 2.5));
    }

    #[test]
    fn unknown_encodings_and_short_data_are_refused() {
        let odd = Image {
            width: 1,
            height: 1,
            step: 1,
            encoding: "yuv".into(),
            ..Image::default()
        };
        assert!(image(&odd, 2).unwrap_err().to_string().contains("yuv"));
        let short = Image {
            width: 4,
            height: 4,
            step: 4,
            encoding: "mono8".into(),
            ..Image::default()
        };
        assert!(image(&short, 2).unwrap_err().to_string().contains("16"));
    }
}
