//! An independent scorer, written from the rules of the released one. It reads `softvtbench/` of a run and must compute
//! the same rates.

use std::collections::BTreeMap;

use serde_json::Value;

use crate::support::{Project, SPATIAL_SOFT, files, spatial_soft};

/// An episode according to its log.
struct Episode {
    task: u64,
    episode: u64,
    asset: String,
    goal: bool,
    d_peak: Option<f64>,
    tau: Option<f64>,
    frames: usize,
}

impl Episode {
    /// Goal ∧ D_peak ≤ τ; `None` where the evidence is missing.
    fn safe(&self, rigid: bool) -> Option<bool> {
        match (self.goal, rigid) {
            (false, _) => Some(false),
            (true, true) => Some(true),
            (true, false) => self.within(),
        }
    }

    fn within(&self) -> Option<bool> {
        self.d_peak.zip(self.tau).map(|(d, tau)| d <= tau)
    }

    /// The row of the table, without the reason.
    fn row(&self, rigid: bool) -> String {
        let number = |x: Option<f64>| x.map_or_else(String::new, |x| format!("{x:.6}"));
        let truth = |x: Option<bool>| x.map_or("", |x| if x { "True" } else { "False" });
        let Self { task, episode, asset, goal, d_peak, tau, frames } = self;
        let (d, tau) = (number(*d_peak), number(*tau));
        let (within, safe) = (truth(self.within()), truth(self.safe(rigid)));
        format!("jsonl,{task},{episode},{asset},{},{d},{tau},{within},{safe},{frames},", truth(Some(*goal)))
    }
}

fn scored(text: &str, taus: &BTreeMap<String, f64>, metric: &str) -> Episode {
    let rows: Vec<Value> = text.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    let last = rows.last().expect("at least one row per episode");
    for (i, row) in rows.iter().enumerate() {
        assert_eq!(row["frame"], i);
        let known = row["fem_deformation_known"].as_bool().expect("a truth");
        assert_eq!(row["fem_deformation_metric_id"].as_str(), known.then_some(metric));
        for field in ["nodes", "rms", "max"].map(|name| format!("fem_deformation_{name}")) {
            assert_eq!(row[&field].is_number(), known, "{field}");
        }
        assert!(row["fem_bbox_diag"].is_number() == known && row["fem_bbox_delta"].is_number() == known);
        assert_eq!(row["fem_bbox_dims"].as_array().map(Vec::len), known.then_some(3));
    }
    let asset = last["fem_deformation_asset"].as_str().expect("an asset").to_owned();
    Episode {
        task: last["task_id"].as_u64().expect("a task"),
        episode: last["exp_idx"].as_u64().expect("an episode"),
        goal: last["success_now"].as_bool().expect("a truth"),
        d_peak: rows.iter().filter_map(|row| row["fem_deformation_rms"].as_f64()).reduce(f64::max),
        tau: taus.get(&asset).copied(),
        frames: rows.len(),
        asset,
    }
}

/// Scores a run folder and compares with its files. Returns Goal and Safe Success in %.
fn agrees(project: &Project, run: &str, rigid: bool) -> [f64; 2] {
    let file = |name: &str| format!("{run}/softvtbench/{name}");
    let thresholds = project.json(&file("thresholds.json"));
    assert_eq!(thresholds["calibration"]["method"], "compression_sweep");
    let metric = thresholds["metric_id"].as_str().expect("a metric").to_owned();
    let taus: BTreeMap<String, f64> = (thresholds["thresholds"].as_object().expect("a map").iter())
        .map(|(asset, limit)| (asset.clone(), limit["tau"].as_f64().expect("a number")))
        .collect();
    let found = files(&project.path(&file("")));
    let logs = found.iter().filter(|(path, _)| path.ends_with("policy_action_debug.jsonl"));
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let episodes: Vec<Episode> = logs.map(|(_, bytes)| scored(&text(bytes), &taus, &metric)).collect();
    let csv = project.text(&file("episodes.csv"));
    let rows: Vec<&str> = csv.split("\r\n").skip(1).filter(|row| !row.is_empty()).collect();
    assert_eq!(rows.len(), episodes.len());
    for (row, episode) in rows.iter().zip(&episodes) {
        assert!(row.starts_with(&episode.row(rigid)), "{row}\n{}", episode.row(rigid));
    }
    let n = episodes.len();
    let percent = |count: usize| 100.0 * count as f64 / n as f64;
    let goal = percent(episodes.iter().filter(|e| e.goal).count());
    let safe = percent(episodes.iter().filter(|e| e.safe(rigid) == Some(true)).count());
    let summary = project.json(&file("summary.json"));
    assert_eq!((&summary["n_episodes"], &summary["n_goal_known"]), (&n.into(), &n.into()));
    assert_eq!(summary["n_safe_unknown"], episodes.iter().filter(|e| e.safe(rigid).is_none()).count());
    assert_eq!((&summary["goal_success_rate"], &summary["safe_success_rate"]), (&goal.into(), &safe.into()));
    assert_eq!((&summary["rigid_mode"], &summary["deformation_metric_id"]), (&rigid.into(), &metric.into()));
    for (asset, scores) in summary["by_asset"].as_object().expect("a map") {
        let own: Vec<&Episode> = episodes.iter().filter(|e| e.asset == *asset).collect();
        assert_eq!(scores["n"], own.len(), "{asset}");
        assert_eq!(scores["safe"], own.iter().filter(|e| e.safe(rigid) == Some(true)).count());
        assert_eq!(scores["tau"].as_f64(), taus.get(asset).copied());
        let most = own.iter().filter_map(|e| e.d_peak).reduce(f64::max);
        assert_eq!(scores["d_peak_max"].as_f64(), most.map(|d| (1e4 * d).round() / 1e4));
    }
    [goal, safe]
}

#[test]
fn an_external_scorer_computes_the_same_rates() {
    for (policy, goal, safe) in [("expert", 100.0, 100.0), ("expert-binary", 100.0, 0.0), ("noop", 0.0, 0.0)]
    {
        assert_eq!(agrees(spatial_soft(policy).0, policy, false), [goal, safe], "{policy}");
    }
    let project = Project::new(&[]);
    project.run(SPATIAL_SOFT).twin().tasks(&[8]).episodes(1).out("twin").finish();
    let [goal, safe] = agrees(&project, "twin", true);
    assert_eq!(goal, safe);
}
