//! The record of an episode.

use prost::Message;

use super::example::{Example, Feature};
use crate::{
    DatasetError,
    export::{
        ExportJob,
        demo_reader::DemoReader,
        features::{self, Content},
        selection::SelectedDemo,
    },
};
use softvt_sensing::camera::encode_png;

/// Largest message of Protocol Buffers, bytes.
const MAX_RECORD: usize = i32::MAX as usize;

/// Reads a demonstration and encodes it as a `tf.train.Example`: the values of all steps under the path of each feature
/// in `features.json`.
pub(super) fn read(job: &ExportJob<'_>, demo: &SelectedDemo) -> Result<Vec<u8>, DatasetError> {
    let reader = DemoReader::open(demo)?;
    let (images, vectors): (Vec<_>, Vec<_>) =
        features::all(job).into_iter().partition(|feature| matches!(feature.content, Content::Image(_)));
    let mut observed = Vec::new();
    for feature in vectors {
        let numbers = Feature::floats(reader.numbers(job, &feature)?);
        observed.push(match feature.content {
            Content::Action => ("steps/action".to_owned(), numbers),
            _ => (format!("steps/observation/{}", feature.name), numbers),
        });
    }
    let mut files = [(); 3].map(|()| Vec::new());
    reader.for_each_step(job, |_, step_images| {
        for (files, image) in files.iter_mut().zip(&step_images) {
            files.push(encode_png(image)?);
        }
        Ok(())
    })?;
    let files = images.iter().zip(files);
    observed.extend(
        files.map(|(image, files)| (format!("steps/observation/{}", image.name), Feature::bytes(files))),
    );
    let entry = &demo.entry;
    let steps = entry.num_samples;
    let is_last = |step: usize| step + 1 == steps;
    let flags =
        |is: &dyn Fn(usize) -> bool| Feature::integers((0..steps).map(|i| i64::from(is(i))).collect());

    let step = [
        ("discount", Feature::floats(vec![1.0; steps])),
        ("reward", Feature::floats((0..steps).map(|step| f32::from(u8::from(is_last(step)))).collect())),
        ("is_first", flags(&|step| step == 0)),
        ("is_last", flags(&is_last)),
        ("is_terminal", flags(&is_last)),
        ("language_instruction", Feature::text(&entry.language, steps)),
    ];
    let metadata = [
        ("file_path", Feature::text(&entry.hdf5_path, 1)),
        ("suite", Feature::text(&entry.suite, 1)),
        ("task_id", Feature::integers(vec![entry.task_id as i64])),
        ("episode", Feature::integers(vec![i64::from(entry.episode)])),
        ("demo_id", Feature::integers(vec![entry.demo_id as i64])),
        ("asset_name", Feature::text(&entry.asset_name, 1)),
        ("success", Feature::integers(vec![i64::from(entry.success)])),
    ];
    let step = step.map(|(name, feature)| (format!("steps/{name}"), feature));
    let metadata = metadata.map(|(name, feature)| (format!("episode_metadata/{name}"), feature));
    let example = Example::new(observed.into_iter().chain(step).chain(metadata));
    let bytes = example.encoded_len();
    if bytes > MAX_RECORD {
        let what = format!("its record has {bytes} bytes, and TensorFlow reads at most {MAX_RECORD}");
        return Err(DatasetError::content(&demo.path, format_args!("/data/demo_{}", entry.demo_id), what));
    }
    Ok(example.encode_to_vec())
}
