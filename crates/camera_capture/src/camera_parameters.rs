//! The parameters of one camera, under the names that users of `camera_aravis2` know, below the camera's name.

use std::ops::RangeInclusive;
use std::time::Duration;

use camera_aravis::CameraConfig;
use devices::{Binning, CameraSettings, Region, TriggerMode};
use futures::FutureExt;
use futures::future::{BoxFuture, select_all};
use ros::Node;
use ros::parameters::{Parameter, ParameterError, ParameterHandle, ParameterKind, ParameterValue};

use crate::error::Error;
use crate::place::{GivenPlace, Place};

/// Exposures that fit into a light's longest on-time, microseconds.
const EXPOSURE_MICROS: RangeInclusive<f64> = 10.0..=900_000.0;

/// One camera's parameters.
#[derive(Clone)]
pub(crate) struct CameraParameters {
    camera: String,
    guid: ParameterHandle<String>,
    pub(crate) frame_id: ParameterHandle<String>,
    pub(crate) camera_info_url: ParameterHandle<String>,
    parent_frame_id: ParameterHandle<String>,
    pose: ParameterHandle<Vec<f64>>,
    pose_file: ParameterHandle<String>,
    pub(crate) light_reference: ParameterHandle<Vec<f64>>,
    transport: TransportParameters,
    pub(crate) image: ImageParameters,
}

/// How frames travel; fixed while the node runs.
#[derive(Clone)]
struct TransportParameters {
    packet_size: ParameterHandle<i64>,
    packet_delay: ParameterHandle<i64>,
    packet_socket: ParameterHandle<bool>,
    socket_buffer: ParameterHandle<i64>,
    trigger_source: ParameterHandle<String>,
}

/// How images are taken; changes hold from the next capture on.
#[derive(Clone)]
pub(crate) struct ImageParameters {
    /// Width, height, offsets and binning, in the order of [`ImageValues::pixels`].
    pixels: [ParameterHandle<i64>; 6],
    pub(crate) exposure: ParameterHandle<f64>,
    gain: ParameterHandle<f64>,
    black_level: ParameterHandle<f64>,
    parameters: ros::parameters::Parameters,
}

/// The values of [`ImageParameters`] at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ImageValues {
    /// Width and height (0: the whole sensor), offset x and y, binning horizontal and vertical.
    pixels: [i64; 6],
    /// Microseconds.
    exposure: f64,
    gain: f64,
    black_level: f64,
}

impl CameraParameters {
    pub(crate) fn declare(node: &Node, camera: &str) -> Result<Self, Error> {
        let name = |name: &str| format!("{camera}.{name}");
        let parameters = node.parameters();
        let text = |parameter: &str, default: String, what: &str| {
            parameters.declare(Parameter::string(name(parameter), default).read_only().describe(what))
        };
        Ok(Self {
            camera: camera.to_owned(),
            guid: text(
                "guid",
                String::new(),
                "The camera's serial number, IP or MAC address; an address needs no broadcast",
            )?,
            frame_id: text(
                "frame_id",
                format!("{camera}_optical_frame"),
                "Optical frame: x right, y down, z forward",
            )?,
            camera_info_url: text(
                "camera_info_url",
                String::new(),
                "Calibration file of camera_calibration, of the whole sensor; empty: camera_info has no intrinsics",
            )?,
            parent_frame_id: text(
                "parent_frame_id",
                "link_base".into(),
                "Frame that the camera is fixed to; a link of the arm carries it along",
            )?,
            pose: parameters.declare(
                Parameter::floats(name("pose"), [])
                    .unit("m and unit quaternion")
                    .read_only()
                    .describe("x y z qx qy qz qw of parent_from_camera, told on /tf_static; empty: not known here"),
            )?,
            pose_file: text(
                "pose_file",
                String::new(),
                "File of rakelight calibrate hand-eye that has parent and pose instead; empty: they are given here",
            )?,
            light_reference: parameters.declare(
                Parameter::floats(name("light_reference"), [])
                    .unit("relative")
                    .range(0.0..=1e9)
                    .describe(
                        "Brightness of L1 to L7 that drift is measured from; empty: learned from the first capture",
                    ),
            )?,
            transport: TransportParameters::declare(node, camera)?,
            image: ImageParameters::declare(node, camera)?,
        })
    }

    /// Which camera, and how its frames travel.
    pub(crate) fn config(&self) -> Result<CameraConfig, Error> {
        let config = CameraConfig {
            trigger_line: self.transport.trigger_source.get(),
            packet_socket: self.transport.packet_socket.get(),
            // The ranges of these parameters are the driver's own.
            packet_size: self.transport.packet_size.get() as u32,
            packet_delay: Duration::from_nanos(self.transport.packet_delay.get() as u64),
            socket_buffer: Some(self.transport.socket_buffer.get() as u32).filter(|bytes| *bytes > 0),
            ..CameraConfig::new(self.guid.get())
        };
        config.check().map_err(|problem| Error::Camera {
            camera: self.camera.clone(),
            problem,
        })?;
        Ok(config)
    }

    /// Where the camera is, if it is known here.
    pub(crate) fn place(&self) -> Result<Option<Place>, Error> {
        let given = GivenPlace {
            camera: &self.camera,
            parent_frame_id: self.parent_frame_id.get(),
            pose: self.pose.get(),
            file: self.pose_file.get(),
        };
        given.place()
    }
}

impl TransportParameters {
    fn declare(node: &Node, camera: &str) -> Result<Self, ParameterError> {
        let name = |name: &str| format!("{camera}.{name}");
        let parameters = node.parameters();
        let defaults = CameraConfig::new("");
        let (sizes, delays) = (CameraConfig::PACKET_SIZE, CameraConfig::PACKET_DELAY);
        let nanos = |delay: Duration| delay.as_nanos() as i64;
        Ok(Self {
            packet_size: parameters.declare(
                Parameter::integer(
                    name("TransportLayerControl.GevSCPSPacketSize"),
                    i64::from(defaults.packet_size),
                )
                .unit("bytes")
                .range(i64::from(*sizes.start())..=i64::from(*sizes.end()))
                .read_only()
                .describe("Size of a stream packet with its IP and UDP headers; the network must carry it whole"),
            )?,
            packet_delay: parameters.declare(
                Parameter::integer(name("TransportLayerControl.GevSCPD"), nanos(defaults.packet_delay))
                    .unit("ns")
                    .range(nanos(*delays.start())..=nanos(*delays.end()))
                    .read_only()
                    .describe("Pause between two packets that are received over UDP"),
            )?,
            packet_socket: parameters.declare(
                Parameter::bool(name("TransportLayerControl.packet_socket"), defaults.packet_socket)
                    .read_only()
                    .describe("Receive past the kernel's UDP where the process may (CAP_NET_RAW); else by UDP"),
            )?,
            socket_buffer: parameters.declare(
                Parameter::integer(name("TransportLayerControl.socket_buffer"), 0)
                    .unit("bytes")
                    .range(0..=i64::from(*CameraConfig::SOCKET_BUFFER.end()))
                    .read_only()
                    .describe("Buffer of the UDP socket, as far as the kernel grants it; 0: all that it grants"),
            )?,
            trigger_source: parameters.declare(
                Parameter::string(name("AcquisitionControl.TriggerSource"), defaults.trigger_line)
                    .read_only()
                    .describe("The camera's input that the light controller's trigger line is wired to"),
            )?,
        })
    }
}

impl ImageParameters {
    fn declare(node: &Node, camera: &str) -> Result<Self, ParameterError> {
        let name = |name: &str| format!("{camera}.{name}");
        let parameters = node.parameters();
        let pixels = |parameter: &str, default: i64, range, what: &str| {
            let parameter = Parameter::integer(name(&format!("ImageFormatControl.{parameter}")), default);
            parameters.declare(parameter.unit("pixels").range(range).describe(what))
        };
        let float = |parameter: &str, default: f64, unit: &str, range, what: &str| {
            parameters.declare(
                Parameter::float(name(parameter), default)
                    .unit(unit)
                    .range(range)
                    .describe(what),
            )
        };
        Ok(Self {
            pixels: [
                pixels(
                    "Width",
                    0,
                    0..=65_536,
                    "Columns of the image after binning; 0 with Height 0: all",
                )?,
                pixels(
                    "Height",
                    0,
                    0..=65_536,
                    "Rows of the image after binning; 0 with Width 0: all",
                )?,
                pixels("OffsetX", 0, 0..=65_535, "First column after binning")?,
                pixels("OffsetY", 0, 0..=65_535, "First row after binning")?,
                pixels("BinningHorizontal", 1, 1..=16, "Sensor columns that become one")?,
                pixels("BinningVertical", 1, 1..=16, "Sensor rows that become one")?,
            ],
            exposure: float(
                "AcquisitionControl.ExposureTime",
                2500.0,
                "us",
                EXPOSURE_MICROS,
                "How long the sensor collects light under each panel",
            )?,
            gain: float("AnalogControl.Gain", 0.0, "dB", 0.0..=48.0, "Amplification")?,
            black_level: float(
                "AnalogControl.BlackLevel",
                0.0,
                "digital numbers of 16 bits",
                0.0..=4095.0,
                "Added to every pixel",
            )?,
            parameters: parameters.clone(),
        })
    }

    /// The values now.
    pub(crate) fn values(&self) -> ImageValues {
        ImageValues {
            pixels: std::array::from_fn(|index| self.pixels[index].get()),
            exposure: self.exposure.get(),
            gain: self.gain.get(),
            black_level: self.black_level.get(),
        }
    }

    /// Puts `values` back, so that the parameters show what the camera does.
    pub(crate) fn restore(&self, values: &ImageValues) -> Result<(), ParameterError> {
        let floats = [
            (&self.exposure, values.exposure),
            (&self.gain, values.gain),
            (&self.black_level, values.black_level),
        ];
        let whole = self.pixels.iter().zip(values.pixels).map(named);
        let all: Vec<(String, ParameterValue)> = whole.chain(floats.into_iter().map(named)).collect();
        self.parameters.set_all(&all)
    }

    /// Waits until one of them has another value. Cancel safe.
    pub(crate) async fn changed(&mut self) {
        fn wait<T: ParameterKind + Send + Sync>(handle: &mut ParameterHandle<T>) -> BoxFuture<'_, ()> {
            handle.changed().map(drop).boxed()
        }
        let floats = [&mut self.exposure, &mut self.gain, &mut self.black_level];
        let all = self.pixels.iter_mut().map(wait).chain(floats.into_iter().map(wait));
        select_all(all).await;
    }

    /// Exposures that the parameter allows.
    pub(crate) fn exposure_range() -> RangeInclusive<Duration> {
        let duration = |micros: f64| Duration::from_secs_f64(micros * 1e-6);
        duration(*EXPOSURE_MICROS.start())..=duration(*EXPOSURE_MICROS.end())
    }
}

fn named<T: Clone + ParameterKind>((handle, value): (&ParameterHandle<T>, T)) -> (String, ParameterValue) {
    (handle.name().to_owned(), value.into_value())
}

impl ImageValues {
    /// As a driver takes them.
    pub(crate) fn settings(&self, trigger: TriggerMode) -> Result<CameraSettings, String> {
        // The parameters' ranges are those of a u32.
        let [width, height, x, y, horizontal, vertical] = self.pixels.map(|value| value as u32);
        let region = match (width, height, x, y) {
            (0, 0, 0, 0) => None,
            (1.., 1.., ..) => Some(Region { x, y, width, height }),
            _ => {
                return Err(format!(
                    "ImageFormatControl Width {width}, Height {height}, OffsetX {x}, OffsetY {y}; allowed: Width and \
                     Height 1 at least, or all four 0 for the whole sensor"
                ));
            }
        };
        Ok(CameraSettings {
            region,
            binning: Binning { horizontal, vertical },
            exposure: Duration::from_secs_f64(self.exposure * 1e-6),
            gain_db: self.gain,
            black_level: self.black_level,
            trigger,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(pixels: [i64; 6]) -> ImageValues {
        ImageValues {
            pixels,
            exposure: 1234.5,
            gain: 3.0,
            black_level: 64.0,
        }
    }

    #[test]
    fn no_size_is_the_whole_sensor() {
        let settings = values([0, 0, 0, 0, 2, 4]).settings(TriggerMode::Line).unwrap();
        assert_eq!((settings.region, settings.binning.vertical), (None, 4));
        assert_eq!(settings.exposure, Duration::from_nanos(1_234_500));
    }

    #[test]
    fn half_a_size_is_refused_with_what_is_allowed() {
        for pixels in [[640, 0, 0, 0, 1, 1], [0, 480, 0, 0, 1, 1], [0, 0, 8, 0, 1, 1]] {
            let problem = values(pixels).settings(TriggerMode::Line).unwrap_err();
            assert!(problem.contains("allowed: Width and Height 1 at least"), "{problem}");
        }
        let region = values([640, 480, 8, 4, 1, 1])
            .settings(TriggerMode::Software)
            .unwrap()
            .region;
        assert_eq!(
            region,
            Some(Region {
                x: 8,
                y: 4,
                width: 640,
                height: 480
            })
        );
    }
}
