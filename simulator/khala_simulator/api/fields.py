"""The fields of messages that are written without the message classes: the key of each, which stands before its value.

Above: `raw.py` and `ui.py`. Below: `wire.py`, which writes them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from google.protobuf.descriptor import FieldDescriptor
from s2clientprotocol import raw_pb2, ui_pb2

if TYPE_CHECKING:
    from google.protobuf.message import Message

_WIRE_TYPES: Final = {FieldDescriptor.CPPTYPE_MESSAGE: 2, FieldDescriptor.CPPTYPE_FLOAT: 5}  # else it is a number


def key(message: type[Message], name: str) -> int:
    """Return the key of a field: its number, and how its value is written."""
    field = message.DESCRIPTOR.fields_by_name[name]
    return field.number << 3 | _WIRE_TYPES.get(field.cpp_type, 0)


UNITS: Final = key(raw_pb2.ObservationRaw, "units")

DISPLAY_TYPE: Final = key(raw_pb2.Unit, "display_type")
ALLIANCE: Final = key(raw_pb2.Unit, "alliance")
TAG: Final = key(raw_pb2.Unit, "tag")
UNIT_TYPE: Final = key(raw_pb2.Unit, "unit_type")
OWNER: Final = key(raw_pb2.Unit, "owner")
POS: Final = key(raw_pb2.Unit, "pos")
FACING: Final = key(raw_pb2.Unit, "facing")
RADIUS: Final = key(raw_pb2.Unit, "radius")
BUILD_PROGRESS: Final = key(raw_pb2.Unit, "build_progress")
CLOAK: Final = key(raw_pb2.Unit, "cloak")
IS_SELECTED: Final = key(raw_pb2.Unit, "is_selected")
IS_ON_SCREEN: Final = key(raw_pb2.Unit, "is_on_screen")
IS_BLIP: Final = key(raw_pb2.Unit, "is_blip")
HEALTH: Final = key(raw_pb2.Unit, "health")
HEALTH_MAX: Final = key(raw_pb2.Unit, "health_max")
SHIELD: Final = key(raw_pb2.Unit, "shield")
ENERGY: Final = key(raw_pb2.Unit, "energy")
MINERAL_CONTENTS: Final = key(raw_pb2.Unit, "mineral_contents")
VESPENE_CONTENTS: Final = key(raw_pb2.Unit, "vespene_contents")
IS_FLYING: Final = key(raw_pb2.Unit, "is_flying")
IS_BURROWED: Final = key(raw_pb2.Unit, "is_burrowed")
ORDERS: Final = key(raw_pb2.Unit, "orders")
ADD_ON_TAG: Final = key(raw_pb2.Unit, "add_on_tag")
PASSENGERS: Final = key(raw_pb2.Unit, "passengers")
CARGO_SPACE_TAKEN: Final = key(raw_pb2.Unit, "cargo_space_taken")
CARGO_SPACE_MAX: Final = key(raw_pb2.Unit, "cargo_space_max")
BUFF_IDS: Final = key(raw_pb2.Unit, "buff_ids")
ASSIGNED_HARVESTERS: Final = key(raw_pb2.Unit, "assigned_harvesters")
IDEAL_HARVESTERS: Final = key(raw_pb2.Unit, "ideal_harvesters")
WEAPON_COOLDOWN: Final = key(raw_pb2.Unit, "weapon_cooldown")
DETECT_RANGE: Final = key(raw_pb2.Unit, "detect_range")
ENGAGED_TARGET_TAG: Final = key(raw_pb2.Unit, "engaged_target_tag")
IS_POWERED: Final = key(raw_pb2.Unit, "is_powered")
SHIELD_MAX: Final = key(raw_pb2.Unit, "shield_max")
ENERGY_MAX: Final = key(raw_pb2.Unit, "energy_max")
IS_HALLUCINATION: Final = key(raw_pb2.Unit, "is_hallucination")
IS_ACTIVE: Final = key(raw_pb2.Unit, "is_active")
ATTACK_UPGRADE_LEVEL: Final = key(raw_pb2.Unit, "attack_upgrade_level")
ARMOR_UPGRADE_LEVEL: Final = key(raw_pb2.Unit, "armor_upgrade_level")
SHIELD_UPGRADE_LEVEL: Final = key(raw_pb2.Unit, "shield_upgrade_level")
BUFF_DURATION_REMAIN: Final = key(raw_pb2.Unit, "buff_duration_remain")
BUFF_DURATION_MAX: Final = key(raw_pb2.Unit, "buff_duration_max")
RALLY_TARGETS: Final = key(raw_pb2.Unit, "rally_targets")

ORDER_ABILITY_ID: Final = key(raw_pb2.UnitOrder, "ability_id")
ORDER_TARGET_WORLD_SPACE_POS: Final = key(raw_pb2.UnitOrder, "target_world_space_pos")
ORDER_TARGET_UNIT_TAG: Final = key(raw_pb2.UnitOrder, "target_unit_tag")
ORDER_PROGRESS: Final = key(raw_pb2.UnitOrder, "progress")

PASSENGER_TAG: Final = key(raw_pb2.PassengerUnit, "tag")
PASSENGER_HEALTH: Final = key(raw_pb2.PassengerUnit, "health")
PASSENGER_HEALTH_MAX: Final = key(raw_pb2.PassengerUnit, "health_max")
PASSENGER_SHIELD: Final = key(raw_pb2.PassengerUnit, "shield")
PASSENGER_ENERGY: Final = key(raw_pb2.PassengerUnit, "energy")
PASSENGER_UNIT_TYPE: Final = key(raw_pb2.PassengerUnit, "unit_type")
PASSENGER_SHIELD_MAX: Final = key(raw_pb2.PassengerUnit, "shield_max")
PASSENGER_ENERGY_MAX: Final = key(raw_pb2.PassengerUnit, "energy_max")

RALLY_POINT: Final = key(raw_pb2.RallyTarget, "point")
RALLY_TAG: Final = key(raw_pb2.RallyTarget, "tag")

PANEL_UNITS: Final = key(ui_pb2.MultiPanel, "units")

INFO_UNIT_TYPE: Final = key(ui_pb2.UnitInfo, "unit_type")
INFO_PLAYER_RELATIVE: Final = key(ui_pb2.UnitInfo, "player_relative")
INFO_HEALTH: Final = key(ui_pb2.UnitInfo, "health")
INFO_SHIELDS: Final = key(ui_pb2.UnitInfo, "shields")
INFO_ENERGY: Final = key(ui_pb2.UnitInfo, "energy")
INFO_TRANSPORT_SLOTS_TAKEN: Final = key(ui_pb2.UnitInfo, "transport_slots_taken")
INFO_BUILD_PROGRESS: Final = key(ui_pb2.UnitInfo, "build_progress")
INFO_MAX_HEALTH: Final = key(ui_pb2.UnitInfo, "max_health")
INFO_MAX_SHIELDS: Final = key(ui_pb2.UnitInfo, "max_shields")
INFO_MAX_ENERGY: Final = key(ui_pb2.UnitInfo, "max_energy")
