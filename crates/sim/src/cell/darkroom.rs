//! Develops a camera's images, the next ones ahead of time: a frame has to be there when a real camera's would be.
//!
//! An image depends on what is seen, the light, the camera's settings and how many images with this light there were
//! since the world was given, on nothing else: whether it was developed ahead cannot be seen in it. What the arm does does
//! not make noise begin anew.

use std::collections::HashMap;
use std::time::{Duration, Instant};

use bytes::Bytes;
use gige_vision::PixelFormat;
use imaging::{ByteOrder, Image};
use parking_lot::{Condvar, Mutex};

use super::gallery::Exhibit;
use super::settings::Settings;
use crate::SimError;
use crate::sensor::{Exposure, LightState, mix};

/// Nothing is developed ahead while frames are being served: both would be late.
const QUIET: Duration = Duration::from_millis(30);
/// Kinds of light with an image on the shelf: the usual eight and some more.
const MOST_KINDS: usize = 12;

#[derive(Debug)]
pub(super) struct Darkroom {
    camera: usize,
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug)]
struct State {
    series: u64,
    /// Images given of each kind of light in this series.
    given: HashMap<LightState, u64>,
    shelf: HashMap<LightState, (Recipe, Bytes)>,
    served_at: Instant,
    ended: bool,
}

/// All that an image depends on.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Recipe {
    edition: u64,
    series: u64,
    lights: LightState,
    number: u64,
    settings: Settings,
}

impl Darkroom {
    pub(super) fn new(camera: usize) -> Self {
        Self {
            camera,
            state: Mutex::new(State {
                series: 0,
                given: HashMap::new(),
                shelf: HashMap::new(),
                served_at: Instant::now(),
                ended: false,
            }),
            changed: Condvar::new(),
        }
    }

    /// The next image with this light.
    pub(super) fn image(&self, exhibit: &Exhibit, lights: LightState, settings: &Settings) -> Result<Bytes, SimError> {
        let (recipe, ready) = {
            let mut state = self.state.lock();
            let recipe = state.next(exhibit, lights, settings);
            *state.given.entry(lights).or_default() += 1;
            state.served_at = Instant::now();
            let ready = state.shelf.remove(&lights).filter(|(ready, _)| *ready == recipe);
            (recipe, ready)
        };
        let image = match ready {
            Some((_, image)) => Ok(image),
            None => self.develop(exhibit, &recipe),
        };
        self.state.lock().served_at = Instant::now();
        image
    }

    /// Develops one image that will be asked for next; false when there is nothing to do.
    pub(super) fn work_ahead(&self, exhibit: &Exhibit, settings: &Settings) -> Result<bool, SimError> {
        let Some(recipe) = self.state.lock().missing(exhibit, settings) else {
            return Ok(false);
        };
        let image = self.develop(exhibit, &recipe)?;
        let mut state = self.state.lock();
        // Meanwhile it may have been asked for.
        if state.next(exhibit, recipe.lights, settings) == recipe {
            state.shelf.insert(recipe.lights, (recipe, image));
        }
        Ok(true)
    }

    /// Sleeps for a while, at least until no frame has been served for some time; false at the end.
    pub(super) fn rest(&self, time: Duration) -> bool {
        let mut state = self.state.lock();
        let rested = Instant::now() + time;
        loop {
            let until = rested.max(state.served_at + QUIET);
            if state.ended || Instant::now() >= until {
                break;
            }
            self.changed.wait_until(&mut state, until);
        }
        !state.ended
    }

    pub(super) fn end(&self) {
        self.state.lock().ended = true;
        self.changed.notify_all();
    }

    fn develop(&self, exhibit: &Exhibit, recipe: &Recipe) -> Result<Bytes, SimError> {
        let Settings {
            exposure,
            gain_millidecibels,
            black_level,
            binning,
            region,
            pixel_format,
        } = recipe.settings;
        let exposure = Exposure {
            seconds: exposure.as_secs_f64(),
            gain_decibels: f64::from(gain_millidecibels) / 1000.0,
            black_level,
            averaged: binning[0] * binning[1],
            region,
        };
        let sensor = &exhibit.world.cameras[self.camera].sensor;
        let noise = self.noise(exhibit.world.seed, recipe);
        let image = sensor.expose(&exhibit.sight.rendered, recipe.lights, &exposure, noise)?;
        Ok(pack(image, pixel_format))
    }

    fn noise(&self, seed: u64, recipe: &Recipe) -> u64 {
        let parts = [self.camera as u64, recipe.number];
        let lights = recipe.lights.shares().map(f64::to_bits);
        parts
            .into_iter()
            .chain(lights)
            .fold(mix(seed), |hash, part| mix(hash ^ mix(part.wrapping_add(1))))
    }
}

impl State {
    fn next(&mut self, exhibit: &Exhibit, lights: LightState, settings: &Settings) -> Recipe {
        if self.series != exhibit.series {
            self.series = exhibit.series;
            self.given.clear();
            self.shelf.clear();
        }
        Recipe {
            edition: exhibit.edition,
            series: self.series,
            lights,
            number: self.given.get(&lights).copied().unwrap_or_default(),
            settings: *settings,
        }
    }

    /// The first image of the usual kinds, or of those that were asked for, that is not on the shelf.
    fn missing(&mut self, exhibit: &Exhibit, settings: &Settings) -> Option<Recipe> {
        let usual = (0..=7).map(LightState::single);
        let mut kinds: Vec<_> = usual.chain(self.given.keys().copied()).collect();
        kinds.truncate(MOST_KINDS);
        kinds.into_iter().find_map(|lights| {
            let recipe = self.next(exhibit, lights, settings);
            let ready = self.shelf.get(&lights).is_some_and(|(ready, _)| *ready == recipe);
            (!ready).then_some(recipe)
        })
    }
}

fn pack(image: Image<u16>, format: PixelFormat) -> Bytes {
    if format == PixelFormat::Mono16 && ByteOrder::NATIVE == ByteOrder::Little {
        // These are the bytes on the wire already.
        return Bytes::from_owner(image);
    }
    format.pack(image.pixels()).into()
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::sync::Arc;

    use super::*;
    use crate::cell::Sight;
    use crate::render::RenderedView;
    use crate::sensor::Region;
    use crate::world::World;

    const SIDE: usize = 32;

    fn exhibit(edition: u64) -> Exhibit {
        let world = World::from_yaml("seed: 5", Path::new("")).unwrap();
        let flat = |radiance| Image::filled(SIDE, SIDE, radiance);
        let rendered = RenderedView {
            ambient: flat(0.001),
            lights: std::array::from_fn(|_| flat(0.01)),
            normals: Image::filled(SIDE, SIDE, [0.0, 0.0, 1.0]),
            depth: flat(0.3),
            labels: Image::filled(SIDE, SIDE, 0),
        };
        Exhibit {
            sight: Arc::new(Sight {
                view: world.view(&world.cameras[0], [1, 1]).unwrap(),
                rendered,
                took: Duration::ZERO,
            }),
            world: Arc::new(world),
            edition,
            series: 0,
        }
    }

    fn settings(pixel_format: PixelFormat) -> Settings {
        Settings {
            exposure: Duration::from_micros(2500),
            gain_millidecibels: 0,
            black_level: 0,
            pixel_format,
            binning: [1, 1],
            region: Region {
                x: 0,
                y: 0,
                width: SIDE,
                height: SIDE,
            },
        }
    }

    /// Three images with L1, some developed ahead.
    fn images(ahead: bool) -> Vec<Bytes> {
        let (room, exhibit, settings) = (Darkroom::new(0), exhibit(1), settings(PixelFormat::Mono16));
        let image = || {
            while ahead && room.work_ahead(&exhibit, &settings).unwrap() {}
            room.image(&exhibit, LightState::single(1), &settings).unwrap()
        };
        vec![image(), image(), image()]
    }

    #[test]
    fn images_developed_ahead_are_those_that_would_have_been_developed() {
        let [ahead, on_demand] = [images(true), images(false)];
        assert!(ahead == on_demand, "working ahead shows");
        assert!(ahead[0] != ahead[1] && ahead[1] != ahead[2], "each has its own noise");
    }

    #[test]
    fn the_usual_kinds_of_light_are_made_ready_once_and_again_when_something_changes() {
        let (room, exhibit_1) = (Darkroom::new(0), exhibit(1));
        let count = |exhibit: &Exhibit, settings: &Settings| {
            (0..100)
                .take_while(|_| room.work_ahead(exhibit, settings).unwrap())
                .count()
        };
        let mono16 = settings(PixelFormat::Mono16);
        assert_eq!((count(&exhibit_1, &mono16), count(&exhibit_1, &mono16)), (8, 0));
        room.image(&exhibit_1, LightState::single(4), &mono16).unwrap();
        assert_eq!(count(&exhibit_1, &mono16), 1);
        assert_eq!(count(&exhibit_1, &settings(PixelFormat::Mono8)), 8, "other settings");
        assert_eq!(count(&exhibit(2), &mono16), 8, "another world");
    }

    #[test]
    fn another_sight_of_the_same_world_has_noise_of_its_own() {
        let (room, mono16) = (Darkroom::new(0), settings(PixelFormat::Mono16));
        let image = |edition| room.image(&exhibit(edition), LightState::single(2), &mono16).unwrap();
        let [there, away, back] = [image(1), image(2), image(1)];
        assert!(there != away && there != back && away != back);
        let anew = Exhibit {
            series: 1,
            ..exhibit(3)
        };
        assert!(
            room.image(&anew, LightState::single(2), &mono16).unwrap() == there,
            "another world"
        );
    }

    #[test]
    fn every_pixel_format_has_its_bytes() {
        let (room, exhibit) = (Darkroom::new(1), exhibit(1));
        for format in PixelFormat::ALL {
            let image = room.image(&exhibit, LightState::default(), &settings(format)).unwrap();
            assert_eq!(image.len(), SIDE * SIDE * format.bytes_per_pixel(), "{format:?}");
        }
    }
}
