//! Parameters of physics, robot, judge and sensors that a suite or a run can change.

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use softvt_common::{
    range::RangeError,
    settings::{Setting, SettingField},
    text::{format_number, suggest},
};
use softvt_evaluation::criteria::SuccessCriteria;
use softvt_physics::PhysicsParams;
use softvt_robot::RobotSpec;
use softvt_robot::tactile::TactileSpec;
use softvt_scene::CameraSettings;

/// Control period, s: policies act, and results are recorded, at 20 Hz.
pub const CONTROL_DT: f64 = 0.05;

/// Control steps, and frames of a video, per second: 1 / [`CONTROL_DT`].
pub const CONTROL_HZ: u32 = 20;

/// Number of physics steps of `dt` seconds per control step, 3 at 60 Hz. `dt` must divide [`CONTROL_DT`].
pub fn steps_per_control(dt: f64) -> u32 {
    (CONTROL_DT / dt).round().max(1.0) as u32
}

/// A setting that is unknown or cannot have its value.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct SettingsError(String);

impl From<RangeError> for SettingsError {
    fn from(error: RangeError) -> Self {
        Self(error.to_string())
    }
}

/// The error for a path whose part below `parents` is unknown, with the closest of the `known` fields, or all of them.
fn unknown_setting(path: &str, parents: &[&str], known: &[String]) -> SettingsError {
    let group = parents.join(".");
    let Some(key) = path.split('.').nth(parents.len()) else {
        return SettingsError(format!("{path} is a group; its settings are {}", known.join(", ")));
    };
    let hint = match suggest(key, known.iter().map(String::as_str)).filter(|_| !key.is_empty()) {
        Some(close) => format!("did you mean {}?", [parents, &[close]].concat().join(".")),
        None if known.is_empty() => format!("{group} is a single value"),
        None if known.iter().any(|field| field == MODEL) => {
            format!("with its present model, {group} has: {}; set {group}.{MODEL} too", known.join(", "))
        }
        None => format!("{} has: {}", if group.is_empty() { "the root" } else { &group }, known.join(", ")),
    };
    SettingsError(format!("no setting {path:?}; {hint}"))
}

/// All settings of a run. The defaults are those of the benchmark.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    pub physics: PhysicsParams,
    pub robot: RobotSpec,
    pub criteria: SuccessCriteria,
    pub tactile: TactileSpec,
    pub cameras: CameraSettings,
}

impl Settings {
    pub fn list() -> Vec<Setting> {
        let physics = Setting::list::<PhysicsParams>("physics");
        let robot = Setting::list::<RobotSpec>("robot");
        let criteria = Setting::list::<SuccessCriteria>("criteria");
        let tactile = Setting::list::<TactileSpec>("tactile");
        [physics, robot, criteria, tactile, Setting::list::<CameraSettings>("cameras")].concat()
    }

    /// The same with the fields at dotted paths set, such as `robot.pads.static_mu` to `0`, in this order, or in one in
    /// which they can be set. Ranges that depend on each other are checked once all fields are set.
    ///
    /// # Errors
    /// A field does not exist, or its value has a wrong type or is out of range.
    pub fn with_all(&self, fields: &[(String, String)]) -> Result<Self, SettingsError> {
        self.with_unchecked(fields)?.validated()
    }

    /// The physics alone with the fields at dotted paths set, for simulations without the control steps of the
    /// benchmark: `physics.dt` need not divide [`CONTROL_DT`].
    pub fn physics_with(&self, fields: &[(String, String)]) -> Result<PhysicsParams, SettingsError> {
        let changed = self.with_unchecked(fields)?;
        changed.physics.check("physics")?;
        Ok(changed.physics)
    }

    /// Checks that the fields at dotted paths exist and can take their values, whatever the ranges of others.
    ///
    /// # Errors
    /// A field does not exist, or its value has a wrong type.
    pub fn check_fields(&self, fields: &[(String, String)]) -> Result<(), SettingsError> {
        self.with_unchecked(fields).map(|_| ())
    }

    fn with_unchecked(&self, fields: &[(String, String)]) -> Result<Self, SettingsError> {
        let set_all = |fields: &[(String, String)]| {
            fields.iter().try_fold(self.clone(), |changed, (path, value)| changed.replaced(path, value))
        };
        set_all(fields).or_else(|error| {
            // Models before their constants.
            let mut sorted = fields.to_vec();
            sorted.sort_by_key(|(path, _)| (!path.ends_with(MODEL), path.split('.').count()));
            set_all(&sorted).map_err(|_| error)
        })
    }

    fn replaced(&self, path: &str, value: &str) -> Result<Self, SettingsError> {
        let refused = |error: serde_json::Error| SettingsError(format!("{path}: {error}"));
        let mut tree = serde_json::to_value(self).map_err(refused)?;
        // Another model does not keep the constants of the present one.
        let group_of_model =
            path.strip_suffix(MODEL).and_then(|group| group.strip_suffix('.')).filter(|group| {
                let present = tree.pointer(&format!("/{}/{MODEL}", group.replace('.', "/")));
                present.is_some_and(|model| model != value.trim_matches('"'))
            });
        let mut at = &mut tree;
        let mut parents = Vec::new();
        for key in group_of_model.unwrap_or(path).split('.') {
            let known = fields(at);
            at = at.get_mut(key).ok_or_else(|| unknown_setting(path, &parents, &known))?;
            parents.push(key);
        }
        let parsed = serde_json::from_str(value).unwrap_or_else(|_| {
            fraction(value).filter(|_| at.is_number()).map_or_else(|| json!(value), |number| json!(number))
        });
        // Scripts may write 2.0.
        let parsed = match parsed.as_f64().and_then(whole) {
            Some(number) if parsed.is_f64() => json!(number),
            _ => parsed,
        };
        let wrong_type = |expected| {
            SettingsError(format!("{path}: expected {expected}, got {:?}", value.trim_matches('"')))
        };
        *at = match (&*at, parsed) {
            (Value::Object(_), group @ Value::Object(_)) => group,
            // A setting with several models can be given by the name of a model alone.
            (Value::Object(known), Value::String(model)) if known.contains_key(MODEL) => {
                json!({ MODEL: model })
            }
            (Value::Object(_), _) => return Err(unknown_setting(path, &parents, &fields(at))),
            (present, number) if present.is_u64() && !number.is_u64() => {
                return Err(wrong_type("a whole number"));
            }
            (Value::Bool(_), other) if !other.is_boolean() => return Err(wrong_type("true or false")),
            (Value::Number(_) | Value::Null, Value::String(_) | Value::Bool(_)) => {
                return Err(wrong_type("a number"));
            }
            (_, value) => value,
        };
        serde_json::from_value(tree).map_err(refused)
    }

    /// Checks the ranges of all parameters, and that the physics step divides [`CONTROL_DT`]. A step that was rounded
    /// to a few decimals, such as 0.016667, becomes the exact one.
    pub fn validated(mut self) -> Result<Self, SettingsError> {
        self.robot.validate()?;
        self.criteria.check("criteria")?;
        self.tactile.validate()?;
        self.cameras.check("cameras")?;
        self.physics.check("physics")?;
        let dt = self.physics.dt;
        let exact = CONTROL_DT / f64::from(steps_per_control(dt));
        let error = (dt / exact - 1.0).abs();
        if error > ROUNDING {
            let (below, above) = ((CONTROL_DT / dt).ceil(), (CONTROL_DT / dt).floor().max(1.0));
            let [dt, below, above] = [dt, CONTROL_DT / below, CONTROL_DT / above].map(format_number);
            return Err(SettingsError(format!(
                "physics.dt: control runs at 20 Hz, so dt must divide {CONTROL_DT} s; got {dt}, near are {below} and {above}"
            )));
        }
        // 1/140 and 0.05/7 differ in their last bit; both are exact.
        if error > 2.0 * f64::EPSILON {
            self.physics.dt = exact;
        }
        Ok(self)
    }
}

#[cfg(test)]
fn settings_page(list: &[Setting]) -> String {
    let mut text = "# Settings\n\nGenerated by `.ci/regenerate settings`. A run changes settings by `--set PATH=VALUE`, a suite by its field \
                    `settings`; `softvt list settings` prints this list. SI units where nothing else is said. `run.json` holds the \
                    settings of a run.\n"
        .to_owned();
    let mut group = "";
    for setting in list {
        let Setting { path, values, about, .. } = setting;
        let own = path.split('.').next().unwrap_or_default();
        if own != group {
            group = own;
            text += &format!("\n## {group}\n\n| setting | default | values | meaning |\n|---|---|---|---|\n");
        }
        let (default, about) = (setting.default_text(), without_links(about));
        text += &format!("| `{path}` | {default} | {values} | {} |\n", about.replace('|', "\\|"));
    }
    text
}

/// Text without the links of Rust's documentation: [`x`](y) and [`x`] become `x`.
#[cfg(test)]
fn without_links(text: &str) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once("[`") {
        let Some((name, behind)) = after.split_once("`]") else { break };
        out += &format!("{before}`{name}`");
        rest = match behind.strip_prefix('(').and_then(|target| target.split_once(')')) {
            Some((_, behind)) => behind,
            None => behind,
        };
    }
    out + rest
}

/// Largest relative difference of a physics step that was rounded from the exact one.
const ROUNDING: f64 = 5e-4;

/// Names the kind of a setting that can be of several: `tactile.optics.model`.
pub const MODEL: &str = "model";

fn whole(number: f64) -> Option<u64> {
    const LARGEST: f64 = (1_u64 << f64::MANTISSA_DIGITS) as f64;
    (number.fract() == 0.0 && (0.0..=LARGEST).contains(&number)).then_some(number as u64)
}

fn fraction(text: &str) -> Option<f64> {
    let (numerator, denominator) = text.split_once('/')?;
    let number = |text: &str| text.trim().parse::<f64>().ok();
    Some(number(numerator)? / number(denominator)?).filter(|value| value.is_finite())
}

fn fields(group: &Value) -> Vec<String> {
    group.as_object().map_or(Vec::new(), |o| o.keys().cloned().collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use softvt_robot::tactile::{FotsSpec, MarkerModel, OpticsModel};

    impl Settings {
        fn with(&self, path: &str, value: &str) -> Result<Self, SettingsError> {
            self.with_all(&[(path.to_owned(), value.to_owned())])
        }
    }

    #[test]
    fn every_number_has_a_lowest_and_a_highest_value() {
        let numbers = || Settings::list().into_iter().filter(|setting| setting.values.contains("number"));
        let unbounded = numbers().filter(|setting| !setting.values.contains(".."));
        assert_eq!(unbounded.map(|setting| setting.path).collect::<Vec<_>>(), Vec::<String>::new());
        assert!(numbers().count() > 40);
        let message = Settings::default().with("physics.margin", "1e300").expect_err("too large").to_string();
        assert!(message.contains("physics.margin: expected a number in above 0..0.01 (m)"), "{message}");
    }

    #[test]
    fn one_setting_changes_and_others_are_refused() {
        let settings = Settings::default();
        let changed = settings.with("robot.gripper.effort", "0.2").expect("a setting");
        assert_eq!(changed.robot.gripper.effort, 0.2);
        for whole in ["2", "2.0", "2e0"] {
            assert_eq!(settings.with("robot.latency", whole).expect("a whole number").robot.latency, 2);
        }
        for (path, refused, expected) in [
            (
                "tactile",
                "1",
                "tactile is a group; its settings are gel, view, optics, shadows, markers, wear",
            ),
            ("physics.dt.x", "1", "no setting \"physics.dt.x\"; physics.dt is a single value"),
            ("physics.dt", "fast", "physics.dt: expected a number, got \"fast\""),
        ] {
            assert_eq!(settings.with(path, refused).expect_err(refused).to_string(), expected);
        }
    }

    #[test]
    fn the_control_rate_does_not_depend_on_the_physics_step() {
        let with_dt = |dt: f64| Settings::default().with("physics.dt", &dt.to_string());
        for (dt, steps) in [(1.0 / 60.0, 3), (1.0 / 120.0, 6), (1.0 / 240.0, 12), (0.05, 1), (1e-4, 500)] {
            assert_eq!(steps_per_control(dt), steps);
            assert!(with_dt(dt).is_ok());
        }
        assert!(with_dt(1.0 / 50.0).is_err_and(|e| e.to_string().contains("0.0166667 and 0.025")));
    }

    #[test]
    fn a_rounded_physics_step_becomes_exact_and_every_suggestion_is_accepted() {
        let dt =
            |text: &str| Settings::default().with("physics.dt", text).map(|settings| settings.physics.dt);
        for text in ["0.016667", "0.01667", "1/60", "0.016666666666666666", "1.6667e-2"] {
            assert_eq!(
                dt(text).map_err(|e| e.to_string()),
                dt(&(0.05 / 3.0).to_string()).map_err(|e| e.to_string()),
                "{text}"
            );
        }
        assert_eq!(dt("1/140"), Ok(1.0 / 140.0));
        for refused in ["0.02", "0.0168", "1/70"] {
            let message = dt(refused).expect_err("does not divide the period").to_string();
            let suggestions = message.split_once("near are ").expect("suggestions").1.split(" and ");
            suggestions.for_each(|suggested| assert!(dt(suggested).is_ok(), "{message}"));
        }
        for refused in ["1/0", "1/x", "60 Hz", "/"] {
            assert!(dt(refused).is_err_and(|e| e.to_string().contains("expected a number")), "{refused}");
        }
        let effort = Settings::default().with("robot.gripper.effort", "1/4").expect("a number");
        assert_eq!(effort.robot.gripper.effort, 0.25);
    }

    #[test]
    fn the_page_lists_every_setting() {
        let list = Settings::list();
        let page = settings_page(&list);
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/settings.md");
        if std::env::var_os("SOFTVT_WRITE_DOCS").is_some() {
            std::fs::write(path, &page).expect("written");
        }
        assert!(
            std::fs::read_to_string(path).unwrap_or_default() == page,
            "docs/settings.md differs; run .ci/regenerate settings"
        );
        // Each one can be set to its own default.
        for setting in list.iter().filter(|setting| !setting.default.is_null()) {
            let is_constant_of_fots = setting.path.starts_with("tactile.markers.");
            let (path, value) = (&setting.path, setting.default.to_string());
            let set = Settings::default().with(path, value.trim_matches('"'));
            assert!(is_constant_of_fots || set == Ok(Settings::default()), "{path}={value}: {set:?}");
        }
    }

    #[test]
    fn a_model_is_chosen_by_name() {
        let settings = Settings::default();
        for path in ["tactile.markers", "tactile.markers.model"] {
            let changed = settings.with(path, "fots").expect("a model");
            assert_eq!(changed.tactile.markers, MarkerModel::Fots(FotsSpec::default()), "{path}");
        }
        let both = r#"{"model":"taxim","tables":"calib"}"#;
        let taxim = settings.with("tactile.optics", both).expect("a model with its tables");
        assert_eq!(taxim.tactile.optics, OpticsModel::Taxim { tables: "calib".into() });
        let fots = settings.with("tactile.markers", r#"{"model":"fots","scale":15.77}"#).expect("a model");
        assert_eq!(
            fots.with("tactile.markers.model", "elastic"),
            Ok(settings.clone()),
            "without its constants"
        );
        assert_eq!(fots.with("tactile.markers.model", "fots"), Ok(fots.clone()));
    }

    #[test]
    fn constants_of_a_model_are_set_with_it_in_any_order() {
        let settings = Settings::default();
        let constant = ("tactile.markers.dilate".to_owned(), "0.1".to_owned());
        for path in ["tactile.markers", "tactile.markers.model"] {
            let model = (path.to_owned(), "fots".to_owned());
            let fields = [model.clone(), constant.clone()];
            let set = settings.with_all(&fields).expect("the model first");
            assert_eq!(
                set.tactile.markers,
                MarkerModel::Fots(FotsSpec { dilate: 0.1, ..FotsSpec::default() })
            );
            assert_eq!(settings.with_all(&[constant.clone(), model]), Ok(set));
            settings.check_fields(&fields).expect("as a condition");
        }
        assert_eq!(
            settings.with_all(&[constant]).expect_err("elastic").to_string(),
            "no setting \"tactile.markers.dilate\"; with its present model, tactile.markers has: model; set \
             tactile.markers.model too"
        );
    }
}
