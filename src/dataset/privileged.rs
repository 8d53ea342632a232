//! Ground-truth streams: shapes, forces, contact and deformation, which no real robot could measure.

use softvt_evaluation::{
    deformation::{METRIC_ID, V1_METRIC_ID},
    judge::ControlStepScore,
};
use softvt_geometry::Vec3;
use softvt_policy::PadForce;
use softvt_rollout::{BodyConfiguration, FinishedEpisode, Sensors, StateRecording, StepTrace};

use super::{
    demonstration::continuous,
    stream::{DataStream, StreamValues, pose_row},
};

/// All privileged streams. Row i is the state before action i, as in every stream of a demonstration.
pub(super) fn streams(finished: &FinishedEpisode, recording: &StateRecording) -> Vec<DataStream> {
    let mut all = forces(finished, recording);
    all.extend(contact(finished));
    all.extend(deformation(finished));
    all.extend(bodies(recording, finished.actions.len()));
    all
}

/// Loads of the pads, and SoftVTBench's actions with forces.
fn forces(finished: &FinishedEpisode, recording: &StateRecording) -> Vec<DataStream> {
    let steps = finished.actions.len();
    let loads: Vec<[PadForce; 2]> = recording.frames.iter().take(steps).map(Sensors::pad_forces).collect();
    let of = |pick: &dyn Fn(&PadForce) -> Vec3| -> Vec<f64> {
        loads.iter().flatten().flat_map(|pad| <[f64; 3]>::from(pick(pad))).collect()
    };
    let force = of(&|pad| pad.wrench.force);
    let with_forces = continuous(&finished.actions)
        .zip(force.as_chunks::<6>().0)
        .flat_map(|(a, force)| a.to_array().into_iter().chain(*force).collect::<Vec<f64>>());
    vec![
        DataStream::f64("privileged/actions_with_force", &[13], with_forces.collect())
            .unit("m, rad, 1, N", "robot base; forces: pad")
            .attribute("meaning", "the actions, then the force on the left and on the right gel"),
        DataStream::f64("privileged/gripper_net_force", &[2, 3], force).unit("N", "pad"),
        DataStream::f64("privileged/gripper_net_moment", &[2, 3], of(&|pad| pad.wrench.moment))
            .unit("N m", "pad, about its apex"),
    ]
}

/// Rows of the states before each action, given those after each step. `first` is the row of the settled state.
fn shifted<T, N: Clone>(after: &[T], first: Vec<N>, numbers: impl Fn(&T) -> Vec<N>) -> Vec<N> {
    // The state after the last action has no row.
    let before = after.len().saturating_sub(1);
    first.into_iter().chain(after[..before].iter().flat_map(numbers)).collect()
}

fn contact(finished: &FinishedEpisode) -> Vec<DataStream> {
    let trace = &finished.trace;
    if trace.is_empty() {
        return Vec::new();
    }
    let touching = |t: &StepTrace| t.pad_force_n.map(|force| u8::from(force > 0.0)).to_vec();
    vec![
        DataStream::u8("privileged/contact", &[2], shifted(trace, vec![0; 2], touching))
            .attribute("meaning", "whether the left and the right pad press on the target"),
        DataStream::f64(
            "privileged/pad_force",
            &[2],
            shifted(trace, vec![0.0; 2], |t| t.pad_force_n.to_vec()),
        )
        .unit("N", "")
        .attribute("meaning", "normal force of the left and the right pad on the target"),
        DataStream::f64("privileged/slip", &[2], shifted(trace, vec![0.0; 2], |t| t.slip_mm.to_vec()))
            .unit("mm", ""),
        DataStream::u8("privileged/dropped", &[], shifted(trace, vec![0], |t| vec![u8::from(t.dropped)])),
    ]
}

/// D of a soft target, under SoftVTBench's names.
fn deformation(finished: &FinishedEpisode) -> Vec<DataStream> {
    let Some(reference) = &finished.reference else { return Vec::new() };
    let at_rest: [f64; 3] = reference.bbox_m().into();
    let scores = &finished.scores;
    let of = |pick: &dyn Fn(&ControlStepScore) -> Option<f64>| {
        shifted(scores, vec![0.0], |score| vec![pick(score).unwrap_or(f64::NAN)])
    };
    let size = |f: &ControlStepScore| {
        f.targets[0].deformation_v1.map_or(vec![f64::NAN; 3], |d| d.bbox_m.iter().copied().collect())
    };
    let percent = |name: &str, metric: &str, numbers| {
        DataStream::f64(format!("privileged/{name}"), &[], numbers)
            .unit("% of the settled bounding box's diagonal", "")
            .attribute("metric_id", metric)
            .attribute("meaning", "worst over the physics steps of the control step before")
    };
    vec![
        percent("d", METRIC_ID, of(&|f| Some(f.targets[0].deformation?.rms_pct))),
        percent("d_max", METRIC_ID, of(&|f| Some(f.targets[0].deformation?.max_pct))),
        percent(
            "soft_extras/fem_deformation_rms",
            V1_METRIC_ID,
            of(&|f| Some(f.targets[0].deformation_v1?.v1_rms_pct)),
        ),
        DataStream::f64(
            "privileged/soft_extras/fem_bbox_dims",
            &[3],
            shifted(scores, at_rest.to_vec(), size),
        )
        .unit("m", "world"),
    ]
}

/// Nodes of soft bodies and poses of rigid ones.
fn bodies(recording: &StateRecording, steps: usize) -> Vec<DataStream> {
    let mut all: Vec<DataStream> = Vec::new();
    for (at, frame) in recording.frames.iter().take(steps).enumerate() {
        for (index, (name, state)) in recording.sensors.body_configurations(frame).enumerate() {
            if at == 0 {
                all.push(empty(name, &state));
            }
            match (&mut all[index].values, state) {
                (StreamValues::F32(into), BodyConfiguration::Nodes(nodes)) => {
                    into.extend(nodes.iter().flatten().map(|x| *x as f32));
                }
                (StreamValues::F64(into), BodyConfiguration::Pose(pose)) => into.extend(pose_row(&pose)),
                _ => {}
            }
        }
    }
    all
}

fn empty(name: &str, state: &BodyConfiguration) -> DataStream {
    match state {
        BodyConfiguration::Nodes(nodes) => {
            let path = format!("privileged/states/deformable_object/{name}/nodal_pos_w");
            DataStream::f32(path, &[nodes.len(), 3], Vec::new()).unit("m", "world")
        }
        BodyConfiguration::Pose(_) => {
            let path = format!("privileged/states/rigid_object/{name}/root_pose_w");
            let meaning = "position, quaternion w x y z with w >= 0";
            DataStream::f64(path, &[7], Vec::new()).unit("m, 1", "world").attribute("meaning", meaning)
        }
    }
}
