use crate::sample_record;
use std::fs;

use super::*;
use softvt_evaluation::{
    calibration::{CalibrationMeasurements, Envelope, SweepProtocol, SweepRow},
    verdict::TargetVerdict,
};
use softvt_geometry::Vec3;

fn episode(task: usize, asset: &str, edit: impl Fn(&mut EpisodeRecord)) -> EpisodeRecord {
    let mut record = sample_record();
    (record.header.id.task, record.header.asset) = (task, asset.into());
    edit(&mut record);
    record
}

fn records() -> Vec<EpisodeRecord> {
    vec![
        episode(1, "roll", |r| r.verdict.object_mut().d_peak_v1 = Some(1.25)),
        episode(0, "bun", |r| {
            // Dropped: unsafe for softvt, safe for SoftVTBench.
            (r.verdict.no_drop, r.verdict.safety, r.verdict.object_mut().d_peak_v1) =
                (false, false, Some(1.0));
        }),
        episode(2, "cake", |r| r.verdict.object_mut().tau = None),
    ]
}

/// The episodes with a limit of 1 % where they have one.
fn scored(records: &[EpisodeRecord]) -> Vec<ScoredEpisode<'_>> {
    let tau = |record: &EpisodeRecord| record.verdict.object().tau.map(|_| 1.0);
    in_order(records).into_iter().map(|record| ScoredEpisode { record, tau: tau(record) }).collect()
}

#[test]
fn episodes_csv_has_softvtbenchs_columns_and_line_ends() {
    let expected = "source,task,episode,asset,goal_success,d_peak,tau,deform_ok,safe_success,frames,reason\r\n\
        jsonl,0,0,bun,True,1.000000,1.000000,True,True,168,\r\n\
        jsonl,1,0,roll,True,1.250000,1.000000,False,False,168,\r\n\
        jsonl,2,0,cake,True,0.300000,,,,168,missing_tau:cake\r\n";
    assert_eq!(episodes_csv(&scored(&records())), expected);
}

#[test]
fn the_summary_has_softvtbenchs_fields_and_ignores_nodrop() {
    let records = records();
    let s = summary(&scored(&records));
    assert_eq!(s["n_episodes"], 3);
    assert_eq!(s["n_safe_unknown"], 1);
    assert_eq!(s["goal_success_rate"], 100.0);
    assert_eq!(s["safe_success_rate"], 100.0 / 3.0);
    assert_eq!(s["goal_safe_gap"], 66.67);
    assert_eq!(s["rigid_mode"], false);
    let keys: Vec<_> = s["by_asset"].as_object().unwrap().keys().collect();
    assert_eq!(keys, ["bun", "roll", "cake"]);
    assert_eq!(s["by_asset"]["cake"]["d_peak_p50"], 0.3);
    assert!(s["by_asset"]["cake"]["tau"].is_null());
}

#[test]
fn a_rigid_episode_is_safe_if_it_reaches_the_goal() {
    let rigid = episode(0, "box", |r| r.verdict.targets = vec![TargetVerdict::default()]);
    let s = summary(&scored(&[rigid]));
    assert_eq!((s["rigid_mode"].clone(), s["safe_success_rate"].clone()), (json!(true), json!(100.0)));
}

#[test]
fn a_debug_frame_describes_the_shape_of_the_target() {
    let nodes = [Vec3::zeros(), Vec3::x() * 0.06, Vec3::y() * 0.03, Vec3::z() * 0.02];
    let reference = ReferenceShape::new(&nodes, &[1.0; 4]).unwrap();
    let now = nodes.map(|x| Vec3::new(0.5 * x.x, x.y, x.z));
    let d = reference.measure(&now).unwrap();
    let shape = DebugShape::new("bun", Some(&reference), Some(d.v1_rms_pct), Some(d.max_pct), Some(d.bbox_m));
    let frame = serde_json::to_value(DebugFrame::new(&sample_record().header.id, 7, false, shape)).unwrap();
    assert_eq!((&frame["frame"], &frame["exp_idx"], &frame["task_id"]), (&json!(7), &json!(0), &json!(0)));
    assert_eq!(frame["fem_deformation_metric_id"], V1_METRIC_ID);
    assert_eq!(frame["fem_deformation_nodes"], 4);
    assert_eq!(frame["fem_deformation_rms"], d.v1_rms_pct);
    assert!((frame["fem_bbox_diag"].as_f64().unwrap() - 0.07).abs() < 1e-12);
    assert!((frame["fem_bbox_delta"].as_f64().unwrap() - 0.03).abs() < 1e-12);
    let broken = serde_json::to_value(DebugShape::new("bun", Some(&reference), Some(9.5), Some(20.0), None));
    let broken = broken.unwrap();
    assert_eq!(
        (&broken["fem_deformation_known"], &broken["fem_deformation_rms"]),
        (&json!(true), &json!(9.5))
    );
    assert!(broken["fem_bbox_dims"].is_null() && broken["fem_bbox_diag"] == frame["fem_bbox_diag"]);
    let unknown = DebugShape::new("bun", Some(&reference), None, Some(20.0), None);
    assert_eq!(unknown, DebugShape::new("bun", None, None, None, None), "its peak was before");
    let unknown = serde_json::to_value(DebugShape::new("box", None, None, None, None)).unwrap();
    assert_eq!(unknown["fem_deformation_known"], false);
    assert!(unknown["fem_deformation_rms"].is_null());
}

#[test]
fn files_land_where_the_scorer_finds_them() {
    let root = tempfile::tempdir().unwrap();
    let mut thresholds = ThresholdFile::new(0.5, vec![], "softvt".into());
    let row = SweepRow {
        width_mm: 56.0,
        closure: Some(0.3),
        d_pct: 2.0,
        d_v1_pct: Some(2.4),
        force_n: 2.0,
        strain_p95: None,
        min_det_f: 0.6,
        node_speed_m_s: 1e-4,
        both_pads: true,
        slip_mm: 0.0,
        stable: true,
    };
    let scans = CalibrationMeasurements {
        protocol: SweepProtocol::Hand,
        sweep: vec![row],
        ..CalibrationMeasurements::default()
    };
    thresholds.insert("bun", Envelope::new(scans, 0.5));
    write_scores(root.path(), &records(), &thresholds.released()).unwrap();
    let header = sample_record().header;
    let frame = DebugFrame::new(&header.id, 0, true, DebugShape::new("bun", None, None, None, None));
    let path = debug_log_path(root.path(), header.id.index());
    assert!(path.ends_with("softvtbench/task_000/episode_00000/policy_action_debug.jsonl"));
    for (frames, rows) in [(vec![frame.clone(), frame], 2), (vec![], 1)] {
        write_debug_log(&path, &header, &frames).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap().lines().count(), rows);
    }
    assert!(has_scores(root.path()));
    fs::remove_file(root.path().join("softvtbench/episodes.csv")).unwrap();
    assert!(!has_scores(root.path()));
    let written = fs::read_to_string(root.path().join("softvtbench/thresholds.json")).unwrap();
    let written: Value = serde_json::from_str(&written).unwrap();
    assert_eq!(written["schema_version"], 1, "the version of SoftVTBench");
    assert_eq!(written["thresholds"]["bun"]["d_ref"], 2.4);
}
