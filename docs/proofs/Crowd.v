(* Crowds: if a set of places holds at most one vehicle more than those that never leave it, whoever enters it from
   outside stays in it for good, and nobody in it ever moves again. So where somebody's loop leads into such a set and
   out of it, no gate can keep everyone going. *)
Require Import Model.

Section Crowd.
Context `{R : roads}.
Hypothesis wide : forall p, 2 <= slots p.
Variable Q : list nat.
Hypothesis once : NoDup Q.
Variable resident : spot -> bool.
Hypothesis stays : forall s, resident (next s) = resident s.
Hypothesis inside : forall s, resident s = true -> In (place s) Q.

Definition sum (f : nat -> nat) (l : list nat) := list_sum (map f l).
Definition count (b : bool) (l : list spot) := length (filter (fun s => Bool.eqb (resident s) b) l).
Definition residents (D : config) := sum (fun p => count true (D p)) Q.

Lemma sum_ext f g l : (forall p, In p l -> f p = g p) -> sum f l = sum g l.
Proof. unfold sum. induction l; simpl; intro H; auto. Qed.

Lemma sum_add f g l : sum (fun p => f p + g p) l = sum f l + sum g l.
Proof. unfold sum. induction l; simpl; auto. rewrite IHl. lia. Qed.

Lemma sum_le f g l : (forall p, In p l -> f p <= g p) -> sum f l <= sum g l.
Proof. unfold sum. induction l; simpl; intro H; auto. specialize (IHl (fun p I => H p (or_intror I))). specialize (H a (or_introl eq_refl)). lia. Qed.

Lemma sum_of f l p : NoDup l -> In p l -> sum f l = f p + sum (fun r => if Nat.eq_dec r p then 0 else f r) l.
Proof.
  unfold sum. induction l as [|a l IH]; simpl; intros N I; [contradiction|]. inversion N; subst.
  destruct I as [->|I].
  - destruct (Nat.eq_dec p p); [|contradiction]. f_equal. simpl. apply (sum_ext f). intros r Ir.
    destruct (Nat.eq_dec r p); auto. subst. contradiction.
  - destruct (Nat.eq_dec a p); [subst; contradiction|]. rewrite IH; auto. lia.
Qed.

Lemma sum_tight f g l : (forall p, In p l -> f p <= g p) -> sum g l <= sum f l -> forall p, In p l -> f p = g p.
Proof.
  unfold sum. induction l as [|a l IH]; simpl; intros H S p I; [contradiction|].
  assert (L := sum_le f g l (fun p I => H p (or_intror I))). unfold sum in L.
  assert (Ha := H a (or_introl eq_refl)). destruct I as [->|I]; [lia|]. apply IH; auto; lia.
Qed.

Lemma count_app b l m : count b (l ++ m) = count b l + count b m.
Proof. unfold count. rewrite filter_app, app_length. auto. Qed.

Lemma count_all l : length l = count true l + count false l.
Proof. unfold count. induction l as [|s l IH]; simpl; auto. destruct (resident s); simpl; lia. Qed.

Lemma count_one b s : count b [s] = if Bool.eqb (resident s) b then 1 else 0.
Proof. unfold count. simpl. destruct (Bool.eqb (resident s) b); auto. Qed.

Lemma none_counted b l s : count b l = 0 -> In s l -> resident s = negb b.
Proof.
  unfold count. intros C I. apply length_zero_iff_nil in C. destruct (Bool.eqb (resident s) b) eqn:E.
  - assert (F : In s (filter (fun t => Bool.eqb (resident t) b) l)) by (apply filter_In; auto). rewrite C in F. destruct F.
  - destruct (resident s), b; simpl in *; congruence.
Qed.

(* as many residents after a move as before *)
Lemma residents_stay p D E : possible D -> move p D E -> residents E = residents D.
Proof.
  intros P (s & line & Dp & Room & Ep & Eq & Rest).
  assert (Ps : place s = p) by (apply (P p); rewrite Dp; left; auto).
  assert (Qp : place (next s) <> p) by (rewrite <- Ps; apply no_self).
  unfold residents. destruct (resident s) eqn:Rs.
  - assert (I1 : In p Q) by (rewrite <- Ps; auto).
    assert (I2 : In (place (next s)) Q) by (apply inside; rewrite stays; auto).
    set (others := fun (G : config) r => if Nat.eq_dec r p then 0 else count true (G r)).
    rewrite (sum_of (fun r => count true (E r)) Q p once I1), (sum_of (fun r => count true (D r)) Q p once I1).
    fold (others E) (others D).
    rewrite (sum_of (others E) Q (place (next s)) once I2), (sum_of (others D) Q (place (next s)) once I2). unfold others.
    destruct (Nat.eq_dec (place (next s)) p); [contradiction|].
    rewrite Ep, Eq, Dp, count_app, count_one, stays, Rs. replace (s :: line) with ([s] ++ line) by auto.
    rewrite count_app, count_one, Rs. simpl.
    rewrite (sum_ext (fun r => if Nat.eq_dec r (place (next s)) then 0 else if Nat.eq_dec r p then 0 else count true (E r))
                     (fun r => if Nat.eq_dec r (place (next s)) then 0 else if Nat.eq_dec r p then 0 else count true (D r))); [lia|].
    intros r _. destruct (Nat.eq_dec r (place (next s))); auto. destruct (Nat.eq_dec r p); auto. rewrite Rest; auto.
  - apply sum_ext. intros r _. destruct (Nat.eq_dec r p) as [->|Np].
    + rewrite Ep, Dp. replace (s :: line) with ([s] ++ line) by auto. rewrite count_app, count_one, Rs. auto.
    + destruct (Nat.eq_dec r (place (next s))) as [->|Nq].
      * rewrite Eq, count_app, count_one, stays, Rs. simpl. lia.
      * rewrite Rest; auto.
Qed.

Definition crowded (D : config) := sum slots Q <= residents D + 1.

(* who enters closes the set: all in it wait for one another *)
Theorem entering_jams p D E : possible D -> crowded D -> move p D E -> ~ In p Q ->
  (exists s, head D p = Some s /\ In (place (next s)) Q) -> jam (fun r => In r Q) E.
Proof.
  intros P C M Np (s0 & H0 & Iq). assert (PE := move_possible p D E P M).
  assert (RE := residents_stay p D E P M). destruct M as (s & line & Dp & Room & Ep & Eq & Rest).
  unfold head in H0. rewrite Dp in H0. injection H0 as <-. set (q := place (next s)) in *.
  assert (Rs : resident (next s) = false).
  { rewrite stays. destruct (resident s) eqn:Rs; auto. exfalso. apply Np. apply inside in Rs.
    destruct (P p) as [_ A]. rewrite <- (A s); auto. rewrite Dp. left; auto. }
  unfold crowded in C. rewrite <- RE in C. unfold residents in C.
  assert (Sum : sum (fun r => length (E r)) Q = sum (fun r => count true (E r)) Q + sum (fun r => count false (E r)) Q).
  { rewrite <- sum_add. apply sum_ext. intros. apply count_all. }
  assert (One : 1 <= count false (E q)) by (rewrite Eq, count_app, count_one, Rs; simpl; lia).
  assert (S := sum_of (fun r => count false (E r)) Q q once Iq). simpl in S.
  assert (Most : sum (fun r => length (E r)) Q <= sum slots Q) by (apply sum_le; intros r _; apply PE).
  assert (Full : forall r, In r Q -> length (E r) = slots r).
  { apply sum_tight; [intros r _; apply PE|]. lia. }
  assert (Zero : sum (fun r => if Nat.eq_dec r q then 0 else count false (E r)) Q = 0 /\ count false (E q) = 1) by lia.
  destruct Zero as [Zero OneQ].
  assert (Others : forall r, In r Q -> r <> q -> count false (E r) = 0).
  { intros r I N. assert (X := sum_of (fun r => if Nat.eq_dec r q then 0 else count false (E r)) Q r once I). simpl in X.
    rewrite Zero in X. destruct (Nat.eq_dec r q); [contradiction|]. lia. }
  split; [exists q; auto|]. intros r I. split; [apply Full; auto|].
  assert (Hd : exists t l, E r = t :: l /\ resident t = true).
  { destruct (Nat.eq_dec r q) as [->|Nq].
    - rewrite Eq in *. specialize (Full q Iq). rewrite Eq, app_length in Full. simpl in Full.
      destruct (D q) as [|t l] eqn:Dq; [specialize (wide q); simpl in Full; lia|]. exists t, (l ++ [next s]). split; auto.
      apply (none_counted false (t :: l)); [|left; auto]. rewrite count_app, count_one, Rs in OneQ. simpl in *. lia.
    - specialize (Full r I). destruct (E r) as [|t l] eqn:Er; [specialize (wide r); simpl in Full; lia|].
      exists t, l. split; auto. apply (none_counted false (t :: l)); [|left; auto]. rewrite <- Er. auto. }
  destruct Hd as (t & l & Er & Rt). exists (place (next t)). split; [|apply inside; rewrite stays; auto].
  exists t. unfold head. rewrite Er. auto.
Qed.

(* in any run, from the moment that somebody has entered it, nobody in the set moves *)
Theorem crowd_is_the_end (X : nat -> config) (who : nat -> nat) k :
  possible (X 0) -> crowded (X 0) -> (forall i, move (who i) (X i) (X (S i))) ->
  ~ In (who k) Q -> (exists s, head (X k) (who k) = Some s /\ In (place (next s)) Q) ->
  forall j, k < j -> ~ In (who j) Q /\ forall r, In r Q -> X j r = X (S k) r.
Proof.
  intros P C Run N In0.
  assert (Inv : forall i, possible (X i) /\ crowded (X i)).
  { induction i as [|i [Pi Ci]]; auto. split; [eapply move_possible; eauto|].
    unfold crowded in *. rewrite (residents_stay (who i) (X i)); auto. }
  assert (J : forall d, jam (fun r => In r Q) (X (S k + d)) /\ forall r, In r Q -> X (S k + d) r = X (S k) r).
  { induction d as [|d [J Same]].
    - rewrite Nat.add_0_r. split; auto. destruct (Inv k). apply (entering_jams (who k) (X k)); auto.
    - rewrite Nat.add_succ_r. destruct (jam_stays _ _ _ _ J (Run (S k + d))) as (_ & J2 & Same2). split; auto.
      intros r I. rewrite Same2; auto. }
  intros j L. replace j with (S k + (j - S k)) by lia. destruct (J (j - S k)) as [Jj Same].
  split; auto. destruct (jam_stays _ _ _ _ Jj (Run (S k + (j - S k)))) as (Out & _). auto.
Qed.
End Crowd.
Print Assumptions residents_stay.
Print Assumptions entering_jams.
Print Assumptions crowd_is_the_end.
