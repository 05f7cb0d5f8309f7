"""Words of headings in the languages that models answer in: sections of a reply, teams, all teams, negations.

Regular expressions without groups, to be matched without regard to case. A language that is missing costs little:
sections without a heading count as they stand. Above it: `khala_protocol.speech.headings` and
`khala_protocol.speech.reader`.
"""

from __future__ import annotations

ANALYSIS = (
    "analys[ei]s?|an[aá]lisis|an[aá]lise|analisi|analiza|analiz|анализ|аналіз|phân tích|[\u4e00-\u9fff]{0,4}分析|분석"
)
ACTIONS = (
    "actions?|aktion(?:en)?|acciones|acción|ações|ação|azion[ei]|acties?|akcj[ea]|eylem(?:ler)?|действи[яе]|дії|"
    "hành động|动作|行动|操作|動作|行動|アクション|행동"
)
COMMUNICATIONS = (
    "communications?|messages?|kommunikation|nachrichten|comunicaci(?:ón|ones)|mensajes|comunica(?:ção|ções)|"
    "comunicazion[ei]|messaggi|communicatie|komunikacja|iletişim|İletişim|сообщени[яе]|коммуникаци[яи]|"
    "повідомлення|giao tiếp|通信|通讯|通訊|沟通|溝通|交流|コミュニケーション|メッセージ|통신|소통|메시지"
)
TEAM = (
    r"teams?\b|squads?\b|gruppe\b|equipos?\b|[ée]quipes?\b|squadra\b|команда\b|drużyna\b|tak[\u0131i]m\b|đội\b|"
    "队伍|小队|团队|隊伍|小隊|チーム|팀"
)
"""The word before a team's name."""
TEAM_BEHIND = r"[ \t]+team\b|[ \t]*+(?:队伍|小队|团队|隊伍|小隊|チーム|팀)"
"""The same after the name."""
EVERY_TEAM = (
    r"(?:all|both|each|every)[ \t]+(?:\w++[ \t]+)??teams?|alle[ \t]+(?:teams|gruppen)|beide[ \t]+teams|"
    "todos los equipos|todas as equipes|toutes les équipes|все команды|所有(?:队伍|小队|团队|隊伍)|全部(?:队伍|小队)|"
    r"全チーム|모든[ \t]?팀"
)
NOT_TO_DO = (
    "draft|initial|tentative|possible|potential|candidate|alternative|other|old|discarded|considered|example|sample|"
    "backup|fallback"
)
"""Words before "actions" that say that the following is not to be carried out."""
OFFERED = "valid|available|legal"
"""Words before "actions" that say, as the host does, that the following is possible."""
PAST = "last|previous|past|earlier|rejected"
"""Words before "actions" that say, as the host does, that the following was ordered before."""
HOST_HEADINGS = (
    r"(?:your[ \t]+)?last[ \t]+errors|what[ \t]+will[ \t]+do[ \t]+for[ \t]+team[ \t]+[\w.-]+|"
    r"not[ \t]+possible(?:[ \t]+now)?"
)
"""Headings of an observation above calls that nobody orders, besides those of its actions."""
INSTEAD = "final|revised|corrected|updated|definitive|definite|actual"
"""Words before "actions" that withdraw earlier text under such a heading."""
EXPLANATION = "explanations?|rationale|justification|summary|conclusion|erklärung|explicación|解释|说明|总结"
"""Words that open an explanation of what was said."""
REMARKS = "notes?|remarks?|comments?|strategy|next steps?|reasoning|anmerkungen|notas|备注"
"""Headings of other text that may follow the actions."""
NEGATION = (
    r"\b(?:do(?:es)?[ \t]++not|don['’´`]t|doesn['’´`]t|must[ \t]++not|should[ \t]++not|won['’´`]t|not|never|avoid|"  # noqa: RUF001  # apostrophes as they are written
    r"instead[ \t]++of|rather[ \t]++than|without|no|nicht|kein[en]?|statt|ohne|ne[ \t]++pas|pas[ \t]++de|"
    r"en[ \t]++lugar[ \t]++de|sin|nunca|não|non|не|вместо|"
    r"not[ \t]++yet:?+|(?:never|avoid|do[ \t]++not|don't):)|不要|不用|不能|别|請勿|请勿|而不是"
)
"""Words that withdraw the call right after them."""
