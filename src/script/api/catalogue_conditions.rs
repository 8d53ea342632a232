//! The binding table of conditions: suites run beside changed copies of themselves.

use crate::script::{
    api::catalogue::SUITE,
    schema::{Field, Presence, Range, Record, Type},
};

use Presence::{Optional, Required};

const fn field(name: &'static str, ty: Type, presence: Presence, doc: &'static str) -> Field {
    Field { name, ty, presence, doc }
}

/// One condition.
pub(crate) static CONDITION: Record = Record {
    label: "conditions.conditions",
    class: "softvt.Condition",
    kind: "softvt.Condition",
    doc: "One way in which a run differs from its reference: same tasks, initial states and seeds, other shifts or settings.",
    fields: &[
        field("name", Type::Text, Required, "Name, as in the table; its run is in a folder of that name."),
        field(
            "shift",
            Type::Map(&Type::Number("", Range::ANY)),
            Optional,
            "Shifts by name, as --shift takes them: { mass = 1.25 }.",
        ),
        field(
            "set",
            Type::Map(&Type::OneOf(&[Type::Number("", Range::ANY), Type::Boolean, Type::Text])),
            Optional,
            "Settings by path, as --set takes them: { [\"robot.gripper.effort\"] = 20 }.",
        ),
        field(
            "only",
            Type::Choice(&["deformable", "rigid"]),
            Optional,
            "The object_type of the suites of which it can change anything; in others it is not run, and its row says N/A.",
        ),
    ],
};

/// Suites under conditions.
pub(crate) static CONDITIONS: Record = Record {
    label: "conditions",
    class: "softvt.Conditions",
    kind: "softvt.conditions",
    doc: "Runs suites as they are, then under each condition, and compares episode by episode.",
    fields: &[
        field("name", Type::Name, Required, "Name, as in results."),
        field("suites", Type::List(&Type::Made(&[&SUITE])), Required, "The suites, in order."),
        field("conditions", Type::List(&Type::Nested(&CONDITION)), Required, "The conditions, in order."),
    ],
};
