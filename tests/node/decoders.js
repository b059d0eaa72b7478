// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Third-party decoders of messages, by the schema that comes with them. Foxglove's types are compared with
// @foxglove/schemas, JSON is checked against its JSON Schema. Throws MODULE_NOT_FOUND if the modules are missing.
"use strict";
const protobuf = require("protobufjs");
const descriptor = require("protobufjs/ext/descriptor");
const Ajv = require("ajv/dist/2020").default;
const rosmsg = require("@foxglove/rosmsg");
const ros2 = require("@foxglove/rosmsg2-serialization");
const schemas = require("@foxglove/schemas/internal");

let fail = (text) => { throw Error(text); };

// The fields of a message in the published schema: name -> number, type, repeated.
function published(name) {
  const schema = schemas.foxgloveMessageSchemas[name];
  const enums = Object.values(schemas.foxgloveEnumSchemas).filter((e) => e.parentSchemaName === name);
  return protobuf.parse(schemas.generateProto(schema, enums), { keepCase: true }).root.lookupType("foxglove." + name);
}
const shape = (type) => Object.fromEntries(type.fieldsArray.map((f) => [f.name,
  f.id + " " + f.type.replace(/^\.?(google\.protobuf|foxglove)\.(\w+\.)*/, "").replace(/^.*\./, "") + (f.repeated ? "[]" : "")]));

const compared = new Set();
function compareType(type) {
  if (compared.has(type.fullName) || !type.fullName.startsWith(".foxglove.")) return;
  compared.add(type.fullName);
  const ours = shape(type), theirs = shape(published(type.name));
  // The published schemas may have fields that we do not write; each of our fields must be in them.
  for (const [field, text] of Object.entries(ours))
    if (theirs[field] !== text) fail(`${type.fullName}.${field} is ${text}, published is ${theirs[field]}`);
  for (const field of Object.keys(theirs))
    if (!(field in ours)) fail(`${type.fullName} lacks the published field ${field}`);
  for (const nested of type.nestedArray)
    if (nested instanceof protobuf.Enum) {
      const enums = Object.values(schemas.foxgloveEnumSchemas).find((e) => e.parentSchemaName === type.name);
      for (const value of enums.values)
        if (nested.values[value.name] !== value.value) fail(`${nested.fullName}.${value.name} differs`);
    }
  for (const field of type.fieldsArray) {
    field.resolve();
    if (field.resolvedType instanceof protobuf.Type) compareType(field.resolvedType);
  }
}

// Returns a function that throws if a message does not fit its schema.
function decoderOf(schema, encoding) {
  const text = () => new TextDecoder().decode(schema.data);
  if (encoding === "protobuf") {
    const root = protobuf.Root.fromDescriptor(descriptor.FileDescriptorSet.decode(schema.data));
    const type = root.lookupType(schema.name);
    root.resolveAll();
    compareType(type);
    return (data) => { const message = type.decode(data); const wrong = type.verify(message); if (wrong) throw Error(wrong); return message; };
  }
  if (encoding === "json") {
    const validate = new Ajv({ strict: true, allowUnionTypes: true }).compile(JSON.parse(text()));
    return (data) => {
      const value = JSON.parse(new TextDecoder().decode(data));
      if (!validate(value)) throw Error(JSON.stringify(validate.errors[0]));
      return value;
    };
  }
  const reader = new ros2.MessageReader(rosmsg.parse(text(), { ros2: true }));
  return (data) => reader.readMessage(data);
}

// onFault: called with a sentence for each difference from the published schemas.
module.exports = { decoderOf, compared, onFault: (callback) => { fail = callback; } };
