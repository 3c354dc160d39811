" TMCL, the language of TRINAMIC motion modules.
if exists("b:current_syntax")
  finish
endif
syntax case ignore

syntax match tmclName /\<[A-Za-z_]\w*\>/
syntax match tmclNumber /\$\x\+\>\|%[01]\+\>\|\<0x\x\+\>\|\<0b[01]\+\>\|\<\d\+\%(\.\d\+\)\?\>/
syntax match tmclLabel /\<[A-Za-z_]\w*\ze\s*:/
syntax match tmclConstant /^\s*\zs[A-Za-z_]\w*\ze\s*=/
syntax match tmclInclude /^\s*#include\>/
syntax match tmclData /#data\>/
syntax match tmclFunction /\<\%(SIN\|COS\|TAN\|ASIN\|ACOS\|ATAN\|LOG\|LN\|EXP\|SQRT\|ABS\|INT\|ROUND\|SIGN\|DEG\|RAD\)\>\ze\s*(/

syntax keyword tmclControl JC JA CSUB RSUB CALL RST DJNZ STOP WAIT RETI EI DI VECT
syntax keyword tmclMotion ROR ROL MST MVP MVPA MVPXA ROLA RORA ROLXA RORXA MSTX RFS
syntax keyword tmclCommand SAP GAP STAP RSAP SGP GGP STGP RSGP SIO GIO SAPX GAPX AAPX CALC COMP SAC SCO GCO CCO CALCX
syntax keyword tmclCommand AAP AGP CLE ACO CALCVV CALCVA CALCAV CALCVX CALCXV CALCV SIV GIV AIV
syntax keyword tmclCommand UF0 UF1 UF2 UF3 UF4 UF5 UF6 UF7 DATA
syntax keyword tmclWord REL COORD START STATUS TICKS POS REFSW LIMSW ZE NZ EQ NE GT GE LT LE ETO EAL EDV EPO ESD ALL
syntax keyword tmclWord SWAP ADD SUB MUL DIV MOD AND OR XOR NOT LOAD
syntax match tmclWord /\<ABS\>\ze\s*\%(,\|$\)/

syntax match tmclPragma /\/\/\s*\zsgradus:.*/ contained
syntax match tmclComment /\/\/.*/ contains=tmclPragma,@Spell

highlight default link tmclComment Comment
highlight default link tmclPragma PreProc
highlight default link tmclInclude Include
highlight default link tmclData Statement
highlight default link tmclControl Conditional
highlight default link tmclMotion Statement
highlight default link tmclCommand Statement
highlight default link tmclWord Constant
highlight default link tmclFunction Function
highlight default link tmclNumber Number
highlight default link tmclLabel Label
highlight default link tmclConstant Identifier

let b:current_syntax = "tmcl"
