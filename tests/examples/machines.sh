# The scripts of examples/machines: read by run, which see. Each runs once, with its picture where
# there is Matplotlib ($picture); numbers stand beside their closed forms in what they print.

# machine NAME: runs it
machine() {
    # shellcheck disable=SC2086 # words
    "$python" "$root/examples/machines/$1.py" $picture >"$work/$1" 2>&1 </dev/null
    name_of_machine=$1
    [ "$picture" = --no-picture ] || shows 'picture' "^wrote .*.svg\$"
}

# shows WHAT PATTERN: of the machine that ran last
shows() {
    expect "machines/$name_of_machine.py, $1" 0 "$2" cat "$work/$name_of_machine"
}

machine ramp
shows R1 '^R1  stops for good after (s)  *1.674000  *1.673919 '
shows 'place' '^R1  and so many metres  *1.672920  *1.673919 '
shows 'static force' '^R1  held there by (N)  *-1.703489  *-1.703489 '
shows R2 '^R2 .* 10.267000  *10.266909 '
shows R3 '^R3 .* 3.805199  *3.805199 '
shows R4 '^R4 .* 0.435000  *0.434615 '
shows R6 '^R6  x after 3 s (m)  *0.980447  *0.980447 '
shows R7 '^R7 .* 0.399597  *0.399597 '
shows 'zeros' '^R1: velocity at the end -*0.0, -*0.0$'

# the error is first order in the step, of 1 ms: up to 30 ms (e = 0.5), 0.3 s (e = 0.8)
machine bouncing_ball
shows 'rest' '^ 0.5  *1.354571  *1.3[2-5][0-9]  .* 0.0$'
shows 'late rest' '^ 0.8  *4.063713  *[34].[0-9]*  .* 0.0$'
shows 'order' '^order \(0.[89]\|1.0\)$'

machine rocking_block
shows 'first landing' '^lands after 0.347[01][0-9]* s .* 0.6480[0-9] (0.648049) before, 0.610[0-9]* '
shows 'ratio' '^keeps 0.9423077 of its spin, by the formula 0.9423077$'
shows 'dead stop' '^b/h = sqrt(2): keeps -*0.0, just below 0.0006'
shows 'friction' 'slip at mu = 0.148, stick at mu = 0.149 '

machine peg_in_hole
shows 'jamming' '^lambda = 3.000000; 1872 loads: .* 0 not as in '
shows 'edge' ' = 3.00000000[0-9] on$\| = 2.99999999[0-9] on$'
shows 'wedging' '^can wedge to a depth of 0.00\(4000000\|399999[89]\)[0-9]* m'

machine sliding_finger
shows 'jams' '^jams from 63.43494[89] degrees on'
shows 'force' '^45 degrees: N = 5.65685[34] N (formula 5.656854), slides 0.2730 m (0.2735)$'
shows 'no acceleration' 'at 70: 0; there a step stops it, velocity 0.0,$'

machine belt
shows 'period' 'steps of 5.00e-04 s: period 0.671[0-9]*, '
shows 'the belt'"'"'s velocity' '^while it sticks its velocity is \[0.2\]$'
shows 'LuGre' '^LuGre, .*speed 0.000625: period 0.67[45]'

machine wedge
shows 'pushed' '^pushed in at 1 m/s: velocity -*0.0, -*0.0$'
shows 'two answers' '^pulled by 1 N, at rest: 2 answers '
shows 'out' '^    acceleration 1.000000, separate/separate$'
shows 'jam' '^    acceleration -*0.000000, stick/stick, forces a family of dimension 2$'
shows 'nearest answer' ' takes the nearest answer: velocity -*0$'
shows 'freest answer' ' takes the freest answer: velocity 0.001$'
shows 'threshold' '^it can jam above mu = 0.17632[67][0-9]*, '
shows 'least force' ' at least 1.065892394 N (closed form 1.065892394)'

machine drawer
shows 'two inertias' 'inertia +4.666667 kg, stable$'
shows 'negative' 'inertia -0.666667 kg, unstable$'
shows 'none' '^held back by 1 N: 0 accelerations$'
shows 'critical offset' '^none beyond h = 0.37500000[0-9]*, '
shows 'jam' ' from 1 m/s: velocity 0.0, a jam$'

machine pins
shows 'stable' ': +0.486697 m/s2, stable,'
shows 'unstable' ': -1.918159 m/s2, unstable,'
shows 'jam' '^pulled back: 0 accelerations, a step gives velocity -*0.0$'
shows 'critical friction' '^it jams above mu = 0.20833333[0-9], '
shows 'up' ' up: -10.381253 rad/s2, by virtual work -10.381253$'
shows 'down' ' down: -10.007350 rad/s2, by virtual work -10.007350$'
shows 'energy' ' has lost 9.80[0-9] J, by friction 9.80[0-9] J$'
shows 'rest' '^it rests at -8[0-9.]* degrees, velocity -*0.0$'

machine table
shows 'family' '^    forces from 25 35 -*0 40$'
shows 'other end' '^    to          60 -*0 35 5$'
shows 'wrench' '^a thousand legs: solved, wrench 100.000000 10.000000 30.000000, '

# with the chosen steps' error of 1e-7 each
machine hopper
shows 'closed form' ': apex 0.388[01] m, by the closed form 0.3881; last landing 8.26[45][0-9] s, 8.2649$'
shows 'period' '^period of the gait 0.805227 s, apex 0.451908 m, reached again: 0.805[23] s, 0.4519 m$'
shows 'straight' '^sideways -*0.0, foot in stance -*0.0$'
shows 'forwards' '^forwards: 12 hops, 0.87[0-9] m/s, foot in stance \(-*0.0\|[0-9.]*e-[1-9][0-9]\)$'
shows 'flight' '^in a flight .* rises by 0.\(29\|30\)[0-9]* m, by v^2/(2 g) 0.\(29\|30\)[0-9]*; .*e-1[0-9] m/s$'
shows 'friction' '^friction at most 0.17[0-9]* '

# the textbook's period; published for these data: 0.734 s
machine biped
shows 'textbook' ' after 0.734346 s$'
shows 'contacts' '^with contacts: 10 steps, period 0.73[45][0-9]* s$'
shows 'feet' '^standing feet: speed at most 0.0e+00 m/s, friction at most 0.27[0-9] '
shows 'energy' ' a landing costs 5.\(49\|50\)[0-9]* J, the slope gives 5.4981 J$'

# all reach their order within what four halvings show
machine orders
shows 'frozen' '^pendulum  frozen .* \(0.9[0-9]\|1.0[0-9]\)$'
shows 'implicit' '^brick  *implicit .* \(0.9[0-9]\|1.0[0-9]\)$'
shows 'theta' '^pendulum  theta .* \(1.9[0-9]\|2.0[0-9]\)$'
