//! Settings: parameters that a run may change by name, each declared once.
//!
//! [`settings!`](crate::settings!) makes a struct of them, with defaults, checks of their ranges, and a list for documentation.
//!
//! ```
//! use softvt_common::settings::{Setting, SettingField, SettingRange::*};
//!
//! softvt_common::settings! {
//!     /// Drive of a finger.
//!     pub struct DriveSpec {
//!         /// Stiffness.
//!         kp: f64 = 2000.0, "N/m", Positive;
//!         /// True if it moves at all.
//!         enabled: bool = true;
//!     }
//! }
//! let drive = DriveSpec { kp: -1.0, ..DriveSpec::default() };
//! let error = drive.check("drive").unwrap_err();
//! assert_eq!(error.to_string(), "drive.kp: expected a positive number (N/m), got -1");
//! let names: Vec<String> = Setting::list::<DriveSpec>("drive").into_iter().map(|setting| setting.path).collect();
//! assert_eq!(names, ["drive.kp", "drive.enabled"]);
//! ```

use serde::Serialize;
use serde_json::Value;

use super::text::{NOT_NEGATIVE, POSITIVE, RangeError, check_range, format_number};

/// Values that a number may have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SettingRange {
    /// Greater than 0.
    Positive,
    /// 0 or more.
    NotNegative,
    /// From a lowest to a highest value, both included.
    Between(f64, f64),
}

impl SettingRange {
    /// Checks a value of the setting at `path`.
    ///
    /// # Errors
    /// It is outside of the range.
    pub fn check(self, path: &str, value: f64, unit: &str) -> Result<(), RangeError> {
        let expected = self.text(unit);
        match self {
            Self::Positive => check_range(path, value, POSITIVE, &expected),
            Self::NotNegative => check_range(path, value, NOT_NEGATIVE, &expected),
            Self::Between(low, high) => check_range(path, value, low..=high, &expected),
        }
    }

    /// The range in words: "0 to 0.5 (rad)".
    pub fn text(self, unit: &str) -> String {
        let range = match self {
            Self::Positive => "a positive number".to_owned(),
            Self::NotNegative => "0 or more".to_owned(),
            Self::Between(low, high) => format!("{} to {}", format_number(low), format_number(high)),
        };
        if unit.is_empty() { range } else { format!("{range} ({unit})") }
    }
}

/// One setting, for documentation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Setting {
    /// Dotted path, as `--set` takes it.
    pub path: String,
    /// Value unless a suite or a run changes it; null where it follows from the scene.
    pub default: Value,
    /// Allowed values, in words.
    pub values: String,
    /// Meaning.
    pub about: String,
}

impl Setting {
    /// The default in words.
    pub fn default_text(&self) -> String {
        match &self.default {
            Value::Null => "that of the scene".to_owned(),
            Value::Number(number) => number.as_f64().map_or_else(|| number.to_string(), format_number),
            Value::String(text) => text.clone(),
            other => other.to_string(),
        }
    }

    /// All settings of a group at a path.
    pub fn list<T: SettingField + Default>(path: &str) -> Vec<Self> {
        let mut list = Vec::new();
        T::default().describe(&Declaration { path, unit: "", range: None, about: "" }, &mut list);
        list
    }
}

/// What the declaration of a setting says beside its type and default.
#[derive(Clone, Copy, Debug)]
pub struct Declaration<'a> {
    /// Dotted path.
    pub path: &'a str,
    /// Unit; empty for none.
    pub unit: &'a str,
    /// Range of a number.
    pub range: Option<SettingRange>,
    /// Meaning.
    pub about: &'a str,
}

impl Declaration<'_> {
    /// The setting with this default and these values.
    pub fn setting(&self, default: impl Serialize, values: String) -> Setting {
        let default = serde_json::to_value(default).unwrap_or_default();
        Setting {
            path: self.path.to_owned(),
            default,
            values,
            about: self.about.split_whitespace().collect::<Vec<_>>().join(" "),
        }
    }

    fn number(&self, of: &str) -> String {
        self.range.map_or_else(|| of.to_owned(), |range| range.text(self.unit))
    }
}

/// A setting or a group of settings.
pub trait SettingField {
    /// Appends the settings that this default value stands for.
    fn describe(&self, declaration: &Declaration<'_>, list: &mut Vec<Setting>);

    /// Checks the range of the value at a path, or of all values of a group.
    ///
    /// # Errors
    /// The first value out of its range.
    fn check_declared(&self, declaration: &Declaration<'_>) -> Result<(), RangeError>;

    /// As [`Self::check_declared`], for a group at `path`.
    ///
    /// # Errors
    /// The first value out of its range.
    fn check(&self, path: &str) -> Result<(), RangeError> {
        self.check_declared(&Declaration { path, unit: "", range: None, about: "" })
    }
}

impl SettingField for f64 {
    fn describe(&self, declaration: &Declaration<'_>, list: &mut Vec<Setting>) {
        list.push(declaration.setting(self, declaration.number("a number")));
    }

    fn check_declared(&self, declaration: &Declaration<'_>) -> Result<(), RangeError> {
        declaration.range.map_or(Ok(()), |range| range.check(declaration.path, *self, declaration.unit))
    }
}

impl SettingField for u32 {
    fn describe(&self, declaration: &Declaration<'_>, list: &mut Vec<Setting>) {
        list.push(declaration.setting(self, format!("a whole number, {}", declaration.number("0 or more"))));
    }

    fn check_declared(&self, declaration: &Declaration<'_>) -> Result<(), RangeError> {
        f64::from(*self).check_declared(declaration)
    }
}

impl SettingField for Option<usize> {
    fn describe(&self, declaration: &Declaration<'_>, list: &mut Vec<Setting>) {
        list.push(declaration.setting(self, format!("a whole number, {}", declaration.number("0 or more"))));
    }

    fn check_declared(&self, declaration: &Declaration<'_>) -> Result<(), RangeError> {
        self.map_or(Ok(()), |number| (number as f64).check_declared(declaration))
    }
}

impl SettingField for bool {
    fn describe(&self, declaration: &Declaration<'_>, list: &mut Vec<Setting>) {
        list.push(declaration.setting(self, "true or false".to_owned()));
    }

    fn check_declared(&self, _: &Declaration<'_>) -> Result<(), RangeError> {
        Ok(())
    }
}

/// Declares a group of settings, see the [module](mod@crate::settings).
///
/// A field is `name: type = default, unit, range;`. Switches have neither unit nor range, and groups no default either.
#[macro_export]
macro_rules! settings {
    (
        $(#[$meta:meta])*
        pub struct $name:ident {
            $(
                $(#[doc = $doc:literal])*
                $field:ident: $type:ty $(= $default:expr $(, $unit:literal, $range:expr)?)?;
            )*
        }
    ) => {
        $(#[$meta])*
        #[derive(Clone, Debug, PartialEq, ::serde::Serialize, ::serde::Deserialize)]
        #[serde(default, deny_unknown_fields)]
        pub struct $name {
            $(
                $(#[doc = $doc])*
                $(
                    #[doc = concat!(
                        "\n\nDefault `", stringify!($default), "`" $(, ", unit `", $unit, "`, range `", stringify!($range), "`")?, "."
                    )]
                )?
                pub $field: $type,
            )*
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($field: $crate::settings!(@default $type $(, $default)?),)* }
            }
        }

        impl $crate::settings::SettingField for $name {
            fn describe(
                &self,
                declaration: &$crate::settings::Declaration<'_>,
                list: &mut Vec<$crate::settings::Setting>,
            ) {
                $(
                    let path = format!("{}.{}", declaration.path, stringify!($field));
                    let about = concat!($($doc, "\n",)* "");
                    let declared = $crate::settings!(@declared path, about $($(, $unit, $range)?)?);
                    $crate::settings::SettingField::describe(&self.$field, &declared, list);
                )*
            }

            fn check_declared(
                &self,
                declaration: &$crate::settings::Declaration<'_>,
            ) -> Result<(), $crate::text::RangeError> {
                $(
                    let path = format!("{}.{}", declaration.path, stringify!($field));
                    let declared = $crate::settings!(@declared path, "" $($(, $unit, $range)?)?);
                    $crate::settings::SettingField::check_declared(&self.$field, &declared)?;
                )*
                Ok(())
            }
        }
    };
    (@default $type:ty) => { <$type>::default() };
    (@default $type:ty, $default:expr) => { $default };
    (@declared $path:ident, $about:expr) => {
        $crate::settings::Declaration { path: &$path, unit: "", range: None, about: $about }
    };
    (@declared $path:ident, $about:expr, $unit:literal, $range:expr) => {
        $crate::settings::Declaration { path: &$path, unit: $unit, range: Some($range), about: $about }
    };
}
