//! Settings: parameters that a run may change by name, each declared once.
//!
//! [`settings!`](crate::settings!) makes a struct of them, with defaults, checks of their ranges, and a list for
//! documentation.
//!
//! ```
//! use softvt_common::{range::Range, settings::{Setting, SettingField}};
//!
//! softvt_common::settings! {
//!     /// Drive of a finger.
//!     pub struct DriveSpec {
//!         /// Stiffness.
//!         kp: f64 = 2000.0, "N/m", Range::POSITIVE;
//!         /// True if it moves at all.
//!         enabled: bool = true;
//!     }
//! }
//! let drive = DriveSpec { kp: -1.0, ..DriveSpec::default() };
//! let error = drive.check("drive").unwrap_err();
//! assert_eq!(error.to_string(), "drive.kp: expected a number above 0 (N/m), got -1");
//! let names: Vec<String> = Setting::list::<DriveSpec>("drive").into_iter().map(|setting| setting.path).collect();
//! assert_eq!(names, ["drive.kp", "drive.enabled"]);
//! ```

use serde::Serialize;
use serde_json::{Value, json};

use super::{
    range::{Range, RangeError},
    text::exact_number,
};

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Setting {
    /// Dotted path, as `--set` takes it.
    pub path: String,
    /// Value unless a suite or a run changes it; null where it follows from the scene.
    pub default: Value,
    /// Allowed values, in words.
    pub values: String,
    pub about: String,
}

impl Setting {
    pub fn default_text(&self) -> String {
        match &self.default {
            Value::Null => "that of the scene".to_owned(),
            Value::Number(number) => number.as_f64().map_or_else(|| number.to_string(), exact_number),
            Value::String(text) => text.clone(),
            other => other.to_string(),
        }
    }

    /// All settings of a group at a path.
    pub fn list<T: SettingField + Default>(path: &str) -> Vec<Self> {
        let mut list = Vec::new();
        T::default().visit(&SettingDeclaration::group(path), &mut |declaration, value| {
            let SettingDeclaration { path, unit, range, about } = *declaration;
            let (default, values) = match value {
                SettingValue::Number(number) => (json!(number), range.expected("a number", unit)),
                SettingValue::Whole(number) => (json!(number), range.expected("a whole number", unit)),
                SettingValue::Switch(is_on) => (json!(is_on), "true or false".to_owned()),
                SettingValue::Word { value, values } => (json!(value), values.to_owned()),
            };
            let about = about.split_whitespace().collect::<Vec<_>>().join(" ");
            list.push(Self { path: path.to_owned(), default, values, about });
        });
        list
    }
}

/// Unit, range and documentation of a setting.
#[derive(Clone, Copy, Debug)]
pub struct SettingDeclaration<'a> {
    pub path: &'a str,
    /// Unit; empty for none.
    pub unit: &'a str,
    pub range: Range,
    pub about: &'a str,
}

impl<'a> SettingDeclaration<'a> {
    fn group(path: &'a str) -> Self {
        Self { path, unit: "", range: Range::ANY, about: "" }
    }
}

/// Value of a setting.
#[derive(Clone, Copy, Debug)]
pub enum SettingValue {
    /// A number within the declared range.
    Number(f64),
    /// A whole number within the declared range; `None` where it follows from the scene.
    Whole(Option<u64>),
    Switch(bool),
    /// A word, and the allowed ones in words.
    Word {
        value: &'static str,
        values: &'static str,
    },
}

/// Receives each setting of a group.
pub type SettingVisitor<'a> = dyn FnMut(&SettingDeclaration<'_>, SettingValue) + 'a;

/// A setting or a group of settings.
pub trait SettingField {
    /// Passes this value, or all values of a group, to `visitor`.
    fn visit(&self, declaration: &SettingDeclaration<'_>, visitor: &mut SettingVisitor<'_>);

    /// Checks the ranges of the values of a group at `path`.
    fn check(&self, path: &str) -> Result<(), RangeError> {
        let mut outcome = Ok(());
        self.visit(&SettingDeclaration::group(path), &mut |declaration, value| {
            let number = match value {
                SettingValue::Number(number) => number,
                SettingValue::Whole(Some(number)) => number as f64,
                _ => return,
            };
            if outcome.is_ok() {
                outcome = declaration.range.check(declaration.path, number, declaration.unit);
            }
        });
        outcome
    }
}

impl SettingField for f64 {
    fn visit(&self, declaration: &SettingDeclaration<'_>, visitor: &mut SettingVisitor<'_>) {
        visitor(declaration, SettingValue::Number(*self));
    }
}

impl SettingField for u32 {
    fn visit(&self, declaration: &SettingDeclaration<'_>, visitor: &mut SettingVisitor<'_>) {
        visitor(declaration, SettingValue::Whole(Some(u64::from(*self))));
    }
}

impl SettingField for Option<usize> {
    fn visit(&self, declaration: &SettingDeclaration<'_>, visitor: &mut SettingVisitor<'_>) {
        visitor(declaration, SettingValue::Whole(self.map(|number| number as u64)));
    }
}

impl SettingField for bool {
    fn visit(&self, declaration: &SettingDeclaration<'_>, visitor: &mut SettingVisitor<'_>) {
        visitor(declaration, SettingValue::Switch(*self));
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
            fn visit(
                &self,
                declaration: &$crate::settings::SettingDeclaration<'_>,
                visitor: &mut $crate::settings::SettingVisitor<'_>,
            ) {
                $(
                    let path = format!("{}.{}", declaration.path, stringify!($field));
                    let about = concat!($($doc, "\n",)* "");
                    let declared = $crate::settings!(@declared path, about $($(, $unit, $range)?)?);
                    $crate::settings::SettingField::visit(&self.$field, &declared, visitor);
                )*
            }
        }
    };
    (@default $type:ty) => { <$type>::default() };
    (@default $type:ty, $default:expr) => { $default };
    (@declared $path:ident, $about:expr) => {
        $crate::settings::SettingDeclaration { path: &$path, unit: "", range: $crate::range::Range::ANY, about: $about }
    };
    (@declared $path:ident, $about:expr, $unit:literal, $range:expr) => {
        $crate::settings::SettingDeclaration { path: &$path, unit: $unit, range: $range, about: $about }
    };
}
