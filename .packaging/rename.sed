# rename.sed - names of roln 0.3 in a program become those of 0.4:    sed -E -i -f rename.sed *.c *.h
# The table of names is in CHANGELOG. A call must stand on one line, its scratch being the last argument.

# scratch: NAME_x takes NAME_x_work, a member of the unions NAME_work, NAME_train and NAME_start
s/\b([A-Za-z]\w*)_linwork\b/\1_linear_work/g
s/\b([A-Za-z]\w*)_lqrwork\b/\1_lqr_work/g
s/\b([A-Za-z]\w*)_filterwork\b/\1_filter_tick_work/g
s/\b([A-Za-z]\w*)_planwork\b/\1_plan_next_work/g
s/_(filter|guard)_tick\(/_\1=tick(/g
s/_(fit|init|grad|chart|newton)_(range|limits|noise|inertia|pod|acc|add|solve|rows|step)\(/_\1=\2(/g
s/\b([A-Za-z]\w*)_(encode|decode|control|gains|lift|allocate)(\(([^()]|\([^()]*\))*), &(\w[A-Za-z0-9_.>-]*)\)/\1_\2\3, \&\5.\2)/g
s/\b([A-Za-z]\w*)_(aim|tick|step|reduce|terms|inverse|inertia)(\(([^()]|\([^()]*\))*), &(\w[A-Za-z0-9_.>-]*)\)/\1_\2\3, \&\5.\2)/g
s/\b([A-Za-z]\w*)_(encode|decode|control|gains|lift|allocate)(\(([^()]|\([^()]*\))*), (work|scratch)\)/\1_\2\3, \&\5->\2)/g
s/\b([A-Za-z]\w*)_(aim|tick|step|reduce|terms|inverse|inertia)(\(([^()]|\([^()]*\))*), (work|scratch)\)/\1_\2\3, \&\5->\2)/g
s/\b([A-Za-z]\w*)_(errors|grad|update|variance|rows|init|store)(\(([^()]|\([^()]*\))*), &(\w[A-Za-z0-9_.>-]*)\)/\1_\2\3, \&\5.\2)/g
s/\b([A-Za-z]\w*)_(errors|grad|update|variance|rows|init|store)(\(([^()]|\([^()]*\))*), (train|work)\)/\1_\2\3, \&\5->\2)/g
s/\b([A-Za-z]\w*)_(fit=(range|limits|noise|inertia)|grad=acc)(\(([^()]|\([^()]*\))*), &(\w[A-Za-z0-9_.>-]*)\)/\1_\2\4, \&\6.\2)/g
s/\b([A-Za-z]\w*)_(init=pod|chart=(add|solve))(\(([^()]|\([^()]*\))*), &(\w[A-Za-z0-9_.>-]*)\)/\1_\2\4, \&\6.\2)/g
s/\b([A-Za-z]\w*)_(guard=tick)(\(([^()]|\([^()]*\))*), &(\w[A-Za-z0-9_.>-]*)\)/\1_\2\3, \&\5.\2)/g
s/\b([A-Za-z]\w*)_(guard=tick)(\(([^()]|\([^()]*\))*), (work|scratch)\)/\1_\2\3, \&\5->\2)/g
s/(filter|guard|fit|init|grad|chart|newton)=(tick|range|limits|noise|inertia|pod|acc|add|solve|rows|step)\b/\1_\2/g

# functions and types
s/_aim\(/_encode_reference(/g
s/([.>])aim\)/\1encode_reference)/g
s/\b([A-Za-z][A-Za-z0-9]*)_terms\(/\1_dynamics(/g
s/([.>])terms\)/\1dynamics)/g
s/_foreign\(/_params_mismatch(/g
s/\b([A-Za-z][A-Za-z0-9]*)_store\(/\1_quantise(/g
s/([.>])store\)/\1quantise)/g
s/_chart_turn\(/_chart_refine(/g
s/\b([A-Za-z][A-Za-z0-9]*)_turn( +\**[A-Za-z_])/\1_refinement\2/g
s/_newton_sums\b/_newton_normal_equations/g
s/_newton_judge\b/_newton_accept/g
s/\broln_newton_over\b/roln_newton_give_up/g
s/\broln_triangle\b/roln_qr_r/g
s/\bROLN_TRIANGLE_WORK\b/ROLN_QR_R_WORK/g
s/\broln_lnn_terms\b/roln_lnn_dynamics/g
s/\broln_terms_out\b/roln_dynamics_out/g
s/\broln_ae_store\b/roln_ae_quantise/g

# options of a config
s/\bROLN_STEP\b/ROLN_INTEGRATOR/g
s/\bROLN_STORE\b/ROLN_QUANTISE/g
s/\bROLN_ROWS\b/ROLN_GN_ROWS/g
s/\bROLN_LEAST\b/ROLN_EIGENVALUE_FLOOR/g
s/\bROLN_CURVES\b/ROLN_MONOMIALS/g
s/\bROLN_TURN_PAIRS\b/ROLN_REFINE_PAIRS/g

# fields: of limits, if the variable is called so, or in an initialiser; of states of guard, filter, plan and check
s/\b([A-Za-z0-9_]*limits?)(\.|->)power\b/\1\2residual/g
s/\b([A-Za-z0-9_]*limits?)(\.|->)window\b/\1\2residual_window/g
s/(^|[ {,])\.power( *=)/\1.residual\2/g
s/(^|[ {,])\.window( *=)/\1.residual_window\2/g
s/\bq_off\b/q_tolerance/g
s/\bqd_off\b/qd_tolerance/g
s/\bg(\.|->)missed\b/g\1allocation_residual/g
s/\b(g|f|plan|check)(\.|->)known\b/\1\2valid/g
s/\bplan(\.|->)gap\b/plan\1duality_gap/g
s/\b(weights|params|p)(\.|->)least\b/\1\2eigenvalue_floor/g
