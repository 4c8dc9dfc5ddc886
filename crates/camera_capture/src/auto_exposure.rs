//! The exposure assistant: finds the exposure at which the brightest pixels are as bright as they should be.

use std::time::Duration;

use photometric::{Brightness, ExposureAdvice};

use crate::camera_parameters::ImageParameters;
use crate::convert;
use crate::error::CaptureFailure;
use crate::session::{CameraCapture, Session};

/// Where the brightest pixels should be, share of full scale: bright, and with room for what is brighter still.
const TARGET: f64 = 0.8;

/// How near is near enough, relative to the target.
const TOLERANCE: f64 = 0.02;

/// Most captures of one call.
const CAPTURES: usize = 6;

/// The longest exposure that is tried: eight of them take a second.
const LONGEST: Duration = Duration::from_millis(100);

/// How the search went for one camera.
struct Search {
    camera: usize,
    before: f64,
    level: f64,
    end: Option<Result<(), String>>,
}

/// Sets every camera's exposure. Says for each what came of it; an error when one did not get there.
pub(crate) async fn adjust(session: &mut Session) -> Result<String, String> {
    let search = |camera: usize| Search {
        camera,
        before: session.cameras[camera].parameters.image.exposure.get(),
        level: 0.0,
        end: None,
    };
    let mut searches: Vec<Search> = (0..session.cameras.len()).map(search).collect();
    for _ in 0..CAPTURES {
        let open: Vec<usize> = searches.iter().filter(|s| s.end.is_none()).map(|s| s.camera).collect();
        if open.is_empty() {
            break;
        }
        if let Err(failure) = step(session, &open, &mut searches).await {
            give_up(session, &mut searches, &failure.to_string());
        }
    }
    give_up(
        session,
        &mut searches,
        &format!("not reached within {CAPTURES} captures"),
    );
    report(session, &searches)
}

/// One capture of the cameras that are not done, and what follows from it.
async fn step(session: &mut Session, open: &[usize], searches: &mut [Search]) -> Result<(), CaptureFailure> {
    let capture = session.capture(open).await?;
    for taken in capture.cameras {
        let Some(search) = searches.iter_mut().find(|search| search.camera == taken.camera) else {
            continue;
        };
        let exposure = taken.settled.applied.settings.exposure;
        let brightness = match brightness(taken).await {
            Ok(brightness) => brightness,
            Err(problem) => {
                end(session, search, problem);
                continue;
            }
        };
        search.level = brightness.level;
        let range = *ImageParameters::exposure_range().start()..=LONGEST.max(exposure);
        match brightness.advise(exposure, TARGET, TOLERANCE, &range) {
            ExposureAdvice::Reached => search.end = Some(Ok(())),
            ExposureAdvice::Expose(exposure) => set(session, search, exposure),
            ExposureAdvice::AtLimit { needed } => {
                search.end = Some(Err(format!("{} us would be needed, out of range", micros(needed))));
            }
            ExposureAdvice::AllDark => end(session, search, "all dark: no light reaches the camera".into()),
        }
    }
    Ok(())
}

async fn brightness(taken: CameraCapture) -> Result<Brightness, String> {
    let measured =
        tokio::task::spawn_blocking(move || convert::sampled_stack(&taken.frames).map(|stack| Brightness::of(&stack)));
    match measured.await {
        Ok(measured) => measured.map_err(|error| error.to_string()),
        Err(error) => Err(error.to_string()),
    }
}

fn set(session: &Session, search: &mut Search, exposure: Duration) {
    let parameter = &session.cameras[search.camera].parameters.image.exposure;
    if let Err(error) = parameter.set(exposure.as_secs_f64() * 1e6) {
        end(session, search, error.to_string());
    }
}

/// Ends a search that failed, with the exposure as it was before.
fn end(session: &Session, search: &mut Search, problem: String) {
    let parameter = &session.cameras[search.camera].parameters.image.exposure;
    let problem = match parameter.set(search.before) {
        Ok(()) => problem,
        Err(error) => format!("{problem}; {error}"),
    };
    search.end = Some(Err(problem));
}

fn give_up(session: &Session, searches: &mut [Search], problem: &str) {
    for search in searches.iter_mut().filter(|search| search.end.is_none()) {
        end(session, search, problem.to_owned());
    }
}

fn report(session: &Session, searches: &[Search]) -> Result<String, String> {
    let line = |search: &Search| {
        let camera = &session.cameras[search.camera];
        let after = camera.parameters.image.exposure.get();
        let level = 100.0 * search.level;
        let figures = format!(
            "{}: {:.0} us -> {after:.0} us, brightest {level:.1} % of full scale",
            camera.name, search.before
        );
        match &search.end {
            Some(Err(problem)) => format!("{figures}, {problem}"),
            _ => figures,
        }
    };
    let text = searches.iter().map(line).collect::<Vec<_>>().join("; ");
    if searches.iter().all(|search| matches!(search.end, Some(Ok(())))) {
        Ok(text)
    } else {
        Err(text)
    }
}

fn micros(duration: Duration) -> u128 {
    duration.as_micros()
}
