//! JSON objects, declared once: the macros, and the variants of a union.

/// Declares a JSON object: `required` or `optional` fields, each with its documentation, its type
/// and, where the type alone does not say enough, its schema.
///
/// The struct has an `Option` for every field; unknown and repeated fields are refused by name, and
/// so is `null`; fields without a value are not written.
#[macro_export]
#[doc(hidden)]
macro_rules! object {
    ($(#[doc = $doc:literal])* pub struct $name:ident {
        $($(#[doc = $fdoc:literal])* $need:ident $field:ident: $type:ty $(= $schema:expr)?),* $(,)?
    }) => {
        $crate::object_type! { $(#[doc = $doc])* $name { $($(#[doc = $fdoc])* $field: $type),* } }
        $crate::described! { $(#[doc = $doc])* $name { $($(#[doc = $fdoc])* $need $field: $type $(= $schema)?),* } }
    };
}

/// Declares a JSON object whose fields depend on a tag: all fields once, then the variants, each
/// with the name of its schema, the fields it requires and allows, in `either [..]` those of which
/// exactly one is given, each with the name of the schema of that choice, and, in `where { .. }`,
/// those that it describes otherwise.
///
/// The struct is flat, so that a fault anywhere inside keeps its exact place; `kind` checks that
/// the fields present are those of the variant. The schema is a `oneOf` with a discriminator.
#[macro_export]
#[doc(hidden)]
macro_rules! union {
    ($(#[doc = $doc:literal])* pub struct $name:ident by $tag:ident: $kind:ident {
        $($(#[doc = $fdoc:literal])* $field:ident: $type:ty $(= $schema:expr)?),* $(,)?
    }
    $($(#[doc = $vdoc:literal])* $text:literal $variant:ident as $schema_name:ident: [$($required:ident),*] [$($optional:ident),*]
        $(either [$($choice:ident as $choice_schema:ident),*])?
        $(where { $($(#[doc = $odoc:literal])* $own:ident = $oschema:expr),* $(,)? })?;)*) => {
        $crate::names! { #[doc = "The variants."] pub enum $kind { $($(#[doc = $vdoc])* $variant = $text),* } }

        $crate::object_type! { $(#[doc = $doc])* $name {
            #[doc = "Which variant this is."] $tag: $kind,
            $($(#[doc = $fdoc])* $field: $type),*
        } }

        impl $name {
            const VARIANTS: &[$crate::api::wire::Variant] = &[$($crate::api::wire::Variant {
                text: $text,
                schema_name: stringify!($schema_name),
                doc: concat!($($vdoc, "\n"),*),
                required: &[$(stringify!($required)),*],
                optional: &[$(stringify!($optional)),*],
                either: &[$($((stringify!($choice), stringify!($choice_schema))),*)?],
                own: || vec![$($($crate::part!($(#[doc = $odoc])* $own: () = $oschema)),*)?],
            }),*];

            /// An empty object of this variant, to be filled for an answer.
            pub fn of(kind: $kind) -> Self {
                Self { $tag: Some(kind), ..Self::default() }
            }

            /// The variant, once it is known that its required fields are there and no foreign
            /// ones.
            ///
            /// # Errors
            /// A missing tag or field, or a field of another variant.
            pub fn kind(&self) -> Result<$kind, $crate::api::error::Error> {
                let kind = self.tag()?;
                $crate::api::wire::Variant::check(Self::VARIANTS, kind as usize, &self.present()[1..])?;
                Ok(kind)
            }

            /// The variant, whatever fields are there.
            fn tag(&self) -> Result<$kind, $crate::api::error::Error> {
                self.$tag.ok_or_else(|| $crate::api::wire::Variant::missing_tag(Self::VARIANTS, stringify!($tag)))
            }

            fn parts() -> Vec<$crate::api::wire::Part> {
                vec![$($crate::part!($(#[doc = $fdoc])* $field: $type $(= $schema)?)),*]
            }
        }

        impl $crate::api::wire::Field for $name {}

        impl $crate::api::wire::Described for $name {
            fn schema() -> utoipa::openapi::RefOr<utoipa::openapi::schema::Schema> {
                utoipa::openapi::schema::Ref::from_schema_name(stringify!($name)).into()
            }

            fn collect(components: &mut Vec<(String, utoipa::openapi::RefOr<utoipa::openapi::schema::Schema>)>) {
                $crate::api::wire::union_schema(
                    stringify!($name), concat!($($doc, "\n"),*), stringify!($tag), Self::VARIANTS, &Self::parts(), components,
                );
                Self::collect_parts(components);
            }
        }
    };
}

/// The struct behind `object!` and `union!`, with its reading and writing.
#[macro_export]
#[doc(hidden)]
macro_rules! object_type {
    ($(#[doc = $doc:literal])* $name:ident { $($(#[doc = $fdoc:literal])* $field:ident: $type:ty),* }) => {
        $(#[doc = $doc])*
        #[derive(Debug, Clone, Default)]
        pub struct $name {
            $($(#[doc = $fdoc])* pub $field: Option<$type>),*
        }

        impl $crate::api::writer::Written for $name {
            fn write_to(&self, writer: &mut $crate::api::writer::Writer) -> Result<(), $crate::api::unwritten::Unwritten> {
                let mut object = writer.object()?;
                $(object.optional(stringify!($field), &self.$field)?;)*
                object.end()
            }
        }

        impl<'de> $crate::api::wire::Read<'de> for $name {
            fn read<D: serde::Deserializer<'de>>(
                reading: &$crate::api::wire::Reading,
                deserializer: D,
            ) -> Result<Self, D::Error> {
                struct ObjectVisitor<'r>(&'r $crate::api::wire::Reading<'r>);
                impl<'de> serde::de::Visitor<'de> for ObjectVisitor<'_> {
                    type Value = $name;

                    fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                        f.write_str(concat!("an object with the fields", $(" `", stringify!($field), "`"),*))
                    }

                    fn visit_map<A: serde::de::MapAccess<'de>>(self, mut map: A) -> Result<$name, A::Error> {
                        // A list of objects may take long to read.
                        self.0.checkpoint::<A::Error>()?;
                        let mut object = $name::default();
                        while let Some(key) = map.next_key::<String>()? {
                            match key.as_str() {
                                $(stringify!($field) => $crate::api::wire::set(
                                    self.0, &mut object.$field, stringify!($field), &mut map,
                                )?,)*
                                _ => $crate::api::wire::refuse(
                                    self.0, &mut map, &key, &[$(stringify!($field)),*],
                                )?,
                            }
                        }
                        Ok(object)
                    }
                }
                deserializer.deserialize_map(ObjectVisitor(reading))
            }
        }

        impl $name {
            #[allow(dead_code, reason = "only unions and tests ask which fields are present")]
            fn present(&self) -> Vec<&'static str> {
                [$(self.$field.is_some().then_some(stringify!($field))),*].into_iter().flatten().collect()
            }

            fn collect_parts(components: &mut Vec<(String, utoipa::openapi::RefOr<utoipa::openapi::schema::Schema>)>) {
                $(<$type as $crate::api::wire::Described>::collect(components);)*
                let _ = components;
            }
        }
    };
}

/// One declared field.
#[macro_export]
#[doc(hidden)]
macro_rules! part {
    ($(#[doc = $doc:literal])* $field:ident: $type:ty = $schema:expr) => {
        $crate::api::wire::Part { name: stringify!($field), doc: concat!($($doc, "\n"),*), schema: $schema.into() }
    };
    ($(#[doc = $doc:literal])* $field:ident: $type:ty) => {
        $crate::part!($(#[doc = $doc])* $field: $type = <$type as $crate::api::wire::Described>::schema())
    };
}

/// Whether a field is required.
#[macro_export]
#[doc(hidden)]
macro_rules! required {
    (required) => {
        true
    };
    (optional) => {
        false
    };
}

/// A declared object that is also a field of others; `answer` where only answers hold it.
#[macro_export]
#[doc(hidden)]
macro_rules! nested {
    ($name:ident) => {
        $crate::nested!(answer $name);
        impl $crate::api::wire::Field for $name {}
    };
    (answer $name:ident) => {
        impl $crate::api::wire::Described for $name {
            fn schema() -> utoipa::openapi::RefOr<utoipa::openapi::schema::Schema> {
                utoipa::openapi::schema::Ref::from_schema_name(stringify!($name)).into()
            }

            fn collect(components: &mut Vec<(String, utoipa::openapi::RefOr<utoipa::openapi::schema::Schema>)>) {
                components.push((stringify!($name).into(), <Self as utoipa::PartialSchema>::schema()));
                Self::collect_parts(components);
            }
        }
    };
}

/// Declares a JSON object that only answers hold: a required field is there, an optional one may
/// be.
#[macro_export]
#[doc(hidden)]
macro_rules! answer {
    ($(#[doc = $doc:literal])* pub struct $name:ident {
        $($(#[doc = $fdoc:literal])* $need:ident $field:ident: $type:ty $(= $schema:expr)?),* $(,)?
    }) => {
        $(#[doc = $doc])*
        #[derive(Debug, Clone)]
        pub struct $name {
            $($(#[doc = $fdoc])* pub $field: $crate::held!($need $type)),*
        }

        impl $crate::api::writer::Written for $name {
            fn write_to(&self, writer: &mut $crate::api::writer::Writer) -> Result<(), $crate::api::unwritten::Unwritten> {
                let mut object = writer.object()?;
                $($crate::write_field!($need object self $field);)*
                object.end()
            }
        }

        impl $name {
            fn collect_parts(components: &mut Vec<(String, utoipa::openapi::RefOr<utoipa::openapi::schema::Schema>)>) {
                $(<$type as $crate::api::wire::Described>::collect(components);)*
                let _ = components;
            }
        }

        $crate::described! { $(#[doc = $doc])* $name { $($(#[doc = $fdoc])* $need $field: $type $(= $schema)?),* } }
    };
}

/// The type of a field of an answer.
#[macro_export]
#[doc(hidden)]
macro_rules! held {
    (required $type:ty) => { $type };
    (optional $type:ty) => { Option<$type> };
}

/// Writes a field of an answer.
#[macro_export]
#[doc(hidden)]
macro_rules! write_field {
    (required $object:ident $self:ident $field:ident) => {
        $object.field(stringify!($field), &$self.$field)?
    };
    (optional $object:ident $self:ident $field:ident) => {
        $object.optional(stringify!($field), &$self.$field)?
    };
}

/// The schema of a declared object.
#[macro_export]
#[doc(hidden)]
macro_rules! described {
    ($(#[doc = $doc:literal])* $name:ident { $($(#[doc = $fdoc:literal])* $need:ident $field:ident: $type:ty $(= $schema:expr)?),* }) => {
        impl utoipa::PartialSchema for $name {
            fn schema() -> utoipa::openapi::RefOr<utoipa::openapi::schema::Schema> {
                $crate::api::wire::schema_of(concat!($($doc, "\n"),*), None, &Self::parts(), &[], |name| match name {
                    $(stringify!($field) => Some($crate::required!($need)),)*
                    _ => None,
                })
            }
        }

        impl utoipa::ToSchema for $name {
            fn name() -> std::borrow::Cow<'static, str> {
                stringify!($name).into()
            }

            fn schemas(components: &mut Vec<(String, utoipa::openapi::RefOr<utoipa::openapi::schema::Schema>)>) {
                Self::collect_parts(components);
            }
        }

        impl $name {
            fn parts() -> Vec<$crate::api::wire::Part> {
                vec![$($crate::part!($(#[doc = $fdoc])* $field: $type $(= $schema)?)),*]
            }
        }
    };
}
